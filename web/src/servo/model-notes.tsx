/** What a model and a firmware mean for their user: a note on request, and always what the tables do not have. */
import { useSignal } from "@preact/signals";
import type { KnownServo } from "../bench/fleet";
import { firmwareNote, unfamiliar } from "../bench/model";
import { text } from "../text";

interface Props {
  one: KnownServo;
  open: boolean;
}

/** Whether the note on a firmware is shown. */
export const useNote = () => useSignal(false);

/** The firmware behind a dot, which shows the note on it where there is one. */
export function FirmwareNote({ one, open, onToggle }: Props & { onToggle: () => void }) {
  if (one.firmware === null) return null;
  const said = text.servos.firmware(one.firmware);
  return (
    <>
      {" · "}
      {firmwareNote(one) === null ? (
        said
      ) : (
        <button
          type="button"
          class="link small"
          aria-expanded={open}
          title={text.model.showNote}
          data-testid="firmware-note"
          onClick={onToggle}
        >
          {said}
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
