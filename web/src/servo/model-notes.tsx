/** Notes on model and firmware: on request, and always where the tables do not have them. */
import { useSignal } from "@preact/signals";
import type { KnownServo } from "../bench/fleet";
import { firmwareNote, unfamiliar } from "../bench/model";
import { text } from "../text";

interface Props {
  one: KnownServo;
  open: boolean;
}

/** The note on a firmware is open. */
export const useNote = () => useSignal(false);

/** The firmware version with a button for its note, if it has one. */
export function FirmwareNote({ one, open, onToggle }: Props & { onToggle: () => void }) {
  if (one.firmware === null) return null;
  const version = text.servos.firmware(one.firmware);
  return (
    <>
      {" · "}
      {firmwareNote(one) === null ? (
        version
      ) : (
        <button
          type="button"
          class="link small"
          aria-expanded={open}
          title={text.model.showNote}
          data-testid="firmware-note"
          onClick={onToggle}
        >
          {version}
        </button>
      )}
    </>
  );
}

export function ModelNotes({ one, open }: Props) {
  const note = open ? firmwareNote(one) : null;
  const lines = [...unfamiliar(one), ...(note === null ? [] : [note])];
  return (
    <>
      {lines.map(line => (
        <p key={line} class="notice-line model-note" data-testid="model-note">
          {line}
        </p>
      ))}
    </>
  );
}
