/** Mark at an angle whose position unit is in conflict: shape, tooltip, and a word for screen readers. */
import type { Servo } from "../api/types";
import { noteText } from "../bench/note-text";
import { text } from "../text";

/** Renders nothing unless Status and 0x08 disagree. */
export function UnitMark({ one }: { one: Servo }) {
  const { state, evidence, evidence_code, evidence_params } = one.position_unit;
  if (!one.online || state !== "conflict") return null;
  const conflict = text.servos.unitConflict;
  return (
    <span
      class="unit-mark"
      title={`${conflict} ${noteText(evidence, evidence_code, evidence_params)}`}
      data-testid={`unit-${one.uid}`}
    >
      <span aria-hidden="true">!</span>
      <span class="hidden-text">{conflict}</span>
    </span>
  );
}
