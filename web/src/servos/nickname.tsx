/** In-place editor of a nickname. */

import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { callApi, problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { changeServos } from "../bench/fleet";
import { up } from "../bench/link";
import { Icon } from "../kit/icon";
import { text } from "../text";

const LONGEST = 64;

export function Nickname({ uid, label, name }: { uid: string; label: string; name: string }) {
  const editing = useSignal(false);
  const problem = useSignal<string | null>(null);
  const box = useRef<HTMLInputElement>(null);
  const open = editing.value;
  useEffect(() => {
    if (open) box.current?.select();
  }, [open]);

  const keep = async () => {
    if (!editing.peek()) return;
    const next = box.current?.value.trim() ?? label;
    editing.value = false;
    problem.value = null;
    if (next === label) return;
    try {
      changeServos([await callApi("PATCH", "/servos/{uid}", { path: { uid }, body: { label: next } })]);
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
  };

  if (open) {
    return (
      <input
        ref={box}
        class="field nickname"
        aria-label={text.servos.nickname}
        data-testid={`nickname-${uid}`}
        maxLength={LONGEST}
        defaultValue={label}
        onBlur={() => void keep()}
        onKeyDown={event => {
          if (event.key === "Enter") void keep();
          if (event.key === "Escape") {
            event.preventDefault();
            editing.value = false;
          }
        }}
      />
    );
  }
  return (
    <>
      <button
        type="button"
        class="pencil"
        aria-label={text.servos.rename(name)}
        data-testid={`rename-${uid}`}
        disabled={!up.value}
        onClick={() => {
          editing.value = true;
        }}
      >
        <Icon name="pencil" size={16} />
      </button>
      {problem.value && (
        <span class="small k-failure" role="alert">
          {problem.value}
        </span>
      )}
    </>
  );
}
