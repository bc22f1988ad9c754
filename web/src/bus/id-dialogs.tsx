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

const said = words.ids;
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
      title={said.pinTitle(ownerName(one.uid))}
      subtitle={<span class="mono">{one.uid}</span>}
      verb={wrong === null ? said.pinConfirm(typed.value.trim()) : said.pinPlain}
      ready={wrong === null}
      testid="pin-dialog"
      actId="pin-confirm"
      act={async () => {
        const body = { node_id: Number(wholeNumber(typed.peek())) };
        return noteOf(await callApi("PUT", "/allocations/{uid}", { path: { uid: one.uid }, body }));
      }}
      onClose={onClose}
    >
      <p class="second">{said.pinText}</p>
      <TextField label={said.pinLabel} at={typed} number beside short error={wrong} testid="pin-id" />
    </Confirm>
  );
}

/** Why a typed node ID cannot be pinned; null if it can. */
export function wrongId(typed: string, one: Allocation, table: readonly Allocation[]): string | null {
  const plain = typed.trim();
  const id = wholeNumber(plain);
  if (id === null || id < LOWEST || id > HIGHEST) return said.pinRange(plain === "" ? "–" : plain);
  const owner = table.find(other => other.node_id === id && other.uid !== one.uid);
  return owner ? said.pinTaken(String(id), ownerName(owner.uid)) : null;
}

export function ForgetDialog({ one, onClose }: Props) {
  const id = String(one.node_id);
  return (
    <Confirm
      title={said.forgetTitle(id, ownerName(one.uid))}
      subtitle={<span class="mono">{one.uid}</span>}
      verb={said.forgetConfirm(id)}
      danger
      testid="forget-dialog"
      actId="forget-confirm"
      act={async () => noteOf(await callApi("DELETE", "/allocations/{uid}", { path: { uid: one.uid } }))}
      onClose={onClose}
    >
      <p>{said.forgetText}</p>
      {one.online && <p>{said.forgetOnline}</p>}
      {one.pinned && <p>{said.forgetPinned}</p>}
    </Confirm>
  );
}

function noteOf(done: AllocationChange): string {
  return noteText(done.note, done.note_code, done.note_params);
}
