/** Dialog to rename a servo. */
import { useSignal } from "@preact/signals";
import { callApi } from "../api/client";
import { changeServos, type KnownServo, nameOf } from "../bench/fleet";
import { Confirm } from "../kit/confirm";
import { TextField } from "../kit/field";
import { text } from "../text";
import { overview as words } from "./words";

const LONGEST = 64;

export function Rename({ one, onClose }: { one: KnownServo; onClose: () => void }) {
  const name = useSignal(one.label);
  const { uid } = one;
  return (
    <Confirm
      title={text.servos.rename(nameOf(one))}
      verb={words.saveNotes}
      testid="rename-dialog"
      actId="rename-keep"
      act={async () => {
        changeServos([
          await callApi("PATCH", "/servos/{uid}", { path: { uid }, body: { label: name.peek().trim() } }),
        ]);
      }}
      onClose={onClose}
    >
      <TextField label={text.servos.nickname} at={name} longest={LONGEST} testid="rename-box" />
    </Confirm>
  );
}
