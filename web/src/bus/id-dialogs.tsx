/** The two dialogs of the node id table: pin an id, forget one. */

import { useSignal } from "@preact/signals";
import type { Allocation, AllocationChange } from "../api/bus-types";
import { ask, problemOf } from "../api/client";
import { ownerName } from "../bench/allocations";
import { problemText } from "../bench/facts";
import { noteText } from "../bench/note-text";
import { wholeNumber } from "../bench/number";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { text } from "../text";
import { bus as words } from "../text/topics";

const said = words.ids;
const LOWEST = 1;
const HIGHEST = 125;

interface Props {
  one: Allocation;
  /** Told when the change takes effect; null when nothing was changed. */
  onClose: (note: string | null) => void;
}

export function PinDialog({ one, table, onClose }: Props & { table: readonly Allocation[] }) {
  const typed = useSignal(String(one.node_id));
  const refused = useSignal<string | null>(null);
  const busy = useSignal(false);
  const wrong = wrongId(typed.value, one, table);
  const pin = async () => {
    if (wrong !== null || busy.peek()) return;
    busy.value = true;
    try {
      const body = { node_id: wholeNumber(typed.peek()) };
      onClose(noteOf(await ask<AllocationChange>("PUT", `/allocations/${one.uid}`, { body })));
    } catch (error) {
      refused.value = problemText(problemOf(error));
      busy.value = false;
    }
  };
  const why = wrong ?? refused.value;
  return (
    <Dialog
      title={said.pinTitle(ownerName(one.uid))}
      subtitle={<span class="mono">{one.uid}</span>}
      testid="pin-dialog"
      onClose={() => onClose(null)}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={() => onClose(null)}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="pin-confirm"
            disabled={wrong !== null || busy.value}
            onClick={() => void pin()}
          >
            {wrong === null ? said.pinConfirm(typed.value.trim()) : said.pinPlain}
          </Button>
        </>
      }
    >
      <p class="second">{said.pinText}</p>
      <form
        class="field-row"
        onSubmit={event => {
          event.preventDefault();
          void pin();
        }}
      >
        <label for="pin-id">{said.pinLabel}</label>
        <input
          id="pin-id"
          class="field short"
          data-testid="pin-id"
          inputMode="numeric"
          autocomplete="off"
          value={typed.value}
          aria-invalid={wrong !== null}
          onInput={event => {
            typed.value = event.currentTarget.value;
            refused.value = null;
          }}
        />
      </form>
      {why !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {why}
        </p>
      )}
    </Dialog>
  );
}

/** Why a typed node id cannot be pinned; null when it can. */
export function wrongId(typed: string, one: Allocation, table: readonly Allocation[]): string | null {
  const plain = typed.trim();
  const id = wholeNumber(plain);
  if (id === null || id < LOWEST || id > HIGHEST) return said.pinRange(plain === "" ? "–" : plain);
  const owner = table.find(other => other.node_id === id && other.uid !== one.uid);
  return owner ? said.pinTaken(String(id), ownerName(owner.uid)) : null;
}

export function ForgetDialog({ one, onClose }: Props) {
  const problem = useSignal<string | null>(null);
  const id = String(one.node_id);
  const forget = async () => {
    try {
      onClose(noteOf(await ask<AllocationChange>("DELETE", `/allocations/${one.uid}`)));
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
  };
  return (
    <Dialog
      title={said.forgetTitle(id, ownerName(one.uid))}
      subtitle={<span class="mono">{one.uid}</span>}
      testid="forget-dialog"
      onClose={() => onClose(null)}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={() => onClose(null)}>{text.cancel}</Button>
          </span>
          <Button look="danger" live testid="forget-confirm" onClick={() => void forget()}>
            {said.forgetConfirm(id)}
          </Button>
        </>
      }
    >
      <p>{said.forgetText}</p>
      {one.online && <p>{said.forgetOnline}</p>}
      {one.pinned && <p>{said.forgetPinned}</p>}
      {problem.value !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {problem.value}
        </p>
      )}
    </Dialog>
  );
}

function noteOf(done: AllocationChange): string {
  return noteText(done.note, done.note_code, done.note_params);
}
