/** Number box: stages as typed; Enter and blur format the text. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Draft } from "../bench/draft";
import { decimalsOf, number } from "../bench/format";
import {
  type AllowedSpan,
  check,
  nearestAllowed,
  parseNumber,
  stepOf,
  unfinishedNumber,
} from "../bench/number";

interface Props {
  id: string;
  row: string;
  span: AllowedSpan;
  held: number | null;
  draft: Draft | undefined;
  locked: boolean;
  /** Accessible name without a label. */
  label?: string;
  describedBy: string;
  onDraft: (draft: Draft) => void;
  onCommit: () => void;
  /** Discard the typed text. */
  onRevert: () => void;
  /** Called with true while the text is incomplete, when no error is shown yet. */
  onBeginning: (beginning: boolean) => void;
  /** Called on blur. */
  onLeave?: () => void;
}

export function NumberBox({
  id,
  row,
  span,
  held,
  draft,
  locked,
  label,
  describedBy,
  onDraft,
  onCommit,
  onRevert,
  onBeginning,
  onLeave,
}: Props) {
  const focused = useSignal(false);
  const box = useRef<HTMLInputElement>(null);
  const shown = draft ? draft.text : held === null ? "" : number(held, decimalsOf(span.perUnit));
  const wrong = draft !== undefined && !draft.verdict.ok;

  // After Esc there is nothing to format, though the draft remains until the next render.
  const reverted = useRef(false);
  const put = (typed: string) => onDraft({ text: typed, verdict: check(typed, span) });
  const commit = () => {
    onBeginning(false);
    if (!reverted.current && draft?.verdict.ok && typeof draft.verdict.value === "number") {
      const tidy = number(draft.verdict.value, decimalsOf(span.perUnit));
      if (tidy !== draft.text) put(tidy);
    }
    onCommit();
  };
  const move = (way: number, event: { shiftKey: boolean; altKey: boolean }) => {
    const from = (draft ? parseNumber(draft.text, span.unit) : held) ?? held ?? 0;
    put(number(nearestAllowed(from + way * stepOf(span, event), span), decimalsOf(span.perUnit)));
  };
  const onKey = (event: KeyboardEvent) => {
    if (event.key === "Enter") commit();
    else if (event.key === "Escape") {
      if (draft) event.preventDefault(); // Otherwise it belongs to the surrounding dialog.
      reverted.current = true;
      onBeginning(false);
      onRevert();
    } else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      move(event.key === "ArrowUp" ? 1 : -1, event);
    }
  };
  const turn = useRef(move);
  turn.current = move;
  // Only a focused box handles the wheel: otherwise scrolling would change it. Not passive, hence not onWheel.
  useEffect(() => {
    const input = box.current;
    if (!input) return undefined;
    const onWheel = (event: WheelEvent) => {
      // With Shift some browsers scroll horizontally.
      const by = event.deltaY || event.deltaX;
      if (document.activeElement !== input || input.disabled || by === 0) return;
      event.preventDefault();
      turn.current(by < 0 ? 1 : -1, event);
    };
    input.addEventListener("wheel", onWheel, { passive: false });
    return () => input.removeEventListener("wheel", onWheel);
  }, []);

  return (
    <span class="box" data-focused={focused.value}>
      <input
        ref={box}
        id={id}
        type="text"
        inputMode="decimal"
        autocomplete="off"
        data-testid={`input-${row}`}
        value={shown}
        disabled={locked}
        aria-invalid={wrong}
        {...(label ? { "aria-label": label } : { "aria-describedby": describedBy })}
        onFocus={event => {
          focused.value = true;
          reverted.current = false;
          event.currentTarget.select();
        }}
        onInput={event => {
          const typed = event.currentTarget.value;
          reverted.current = false;
          onBeginning(unfinishedNumber(typed));
          put(typed);
        }}
        onBlur={() => {
          focused.value = false;
          commit();
          onLeave?.();
        }}
        onKeyDown={onKey}
      />
      <span class="unit" aria-hidden="true">
        {span.unit}
      </span>
    </span>
  );
}
