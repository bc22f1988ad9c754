/** The two dialogs of the node ID table: pin an ID, forget an ID. */

import { useSignal } from "@preact/signals";
import type { Allocation, AllocationChange } from "../api/bus-types";
import { callApi } from "../api/client";
import { ownerName } from "../bench/allocations";
import { noteText } from "../bench/note-text";
import { wholeNumber } from "../bench/number";
import { Confirm } from "../kit/confirm";
import { TextField } from "../kit/field";
import { busWords as words } from "./words";

const strings = words.ids;
const LOWEST = 1;
const HIGHEST = 125;

interface Props {
  one: Allocation;
  /** `note` says when the change takes effect; null if nothing changed. */
  onClose: (note: string | null) => void;
}

export function PinDialog({ one, table, onClose }: Props & { table: readonly Allocation[] }) {
  const typed = useSignal(String(one.node_id));
  const wrong = wrongId(typed.value, one, table);
  return (
    <Confirm
      title={strings.pinTitle(ownerName(one.uid))}
      subtitle={<span class="mono">{one.uid}</span>}
      verb={wrong === null ? strings.pinConfirm(typed.value.trim()) : strings.pinPlain}
      ready={wrong === null}
      testid="pin-dialog"
      actId="pin-confirm"
      act={async () => {
        const body = { node_id: Number(wholeNumber(typed.peek())) };
        return noteOf(await callApi("PUT", "/allocations/{uid}", { path: { uid: one.uid }, body }));
      }}
      onClose={onClose}
    >
      <p class="second">{strings.pinText}</p>
      <TextField label={strings.pinLabel} at={typed} number beside short error={wrong} testid="pin-id" />
    </Confirm>
  );
}

/** Why a typed node ID cannot be pinned; null if it can. */
export function wrongId(typed: string, one: Allocation, table: readonly Allocation[]): string | null {
  const plain = typed.trim();
  const id = wholeNumber(plain);
  if (id === null || id < LOWEST || id > HIGHEST) return strings.pinRange(plain === "" ? "–" : plain);
  const owner = table.find(other => other.node_id === id && other.uid !== one.uid);
  return owner ? strings.pinTaken(String(id), ownerName(owner.uid)) : null;
}

export function ForgetDialog({ one, onClose }: Props) {
  const id = String(one.node_id);
  return (
    <Confirm
      title={strings.forgetTitle(id, ownerName(one.uid))}
      subtitle={<span class="mono">{one.uid}</span>}
      verb={strings.forgetConfirm(id)}
      danger
      testid="forget-dialog"
      actId="forget-confirm"
      act={async () => noteOf(await callApi("DELETE", "/allocations/{uid}", { path: { uid: one.uid } }))}
      onClose={onClose}
    >
      <p>{strings.forgetText}</p>
      {one.online && <p>{strings.forgetOnline}</p>}
      {one.pinned && <p>{strings.forgetPinned}</p>}
    </Confirm>
  );
}

function noteOf(done: AllocationChange): string {
  return noteText(done.note, done.note_code, done.note_params);
}
