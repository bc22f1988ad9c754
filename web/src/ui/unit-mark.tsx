/** Owns the small mark at an angle whose unit on the bus is not sure: shape, tooltip, and a word for screen readers. */
import type { Servo } from "../api/types";
import { text } from "../text";

/** Nothing once the unit was measured or forced. */
export function UnitMark({ one }: { one: Servo }) {
  const { state, evidence } = one.position_unit;
  if (!one.online || (state !== "assumed" && state !== "conflict")) return null;
  const said = text.servos.unit[state];
  return (
    <span class={`unit-mark ${state}`} title={`${said} ${evidence}`} data-testid={`unit-${one.uid}`}>
      <span aria-hidden="true">{state === "conflict" ? "!" : "?"}</span>
      <span class="hidden-text">{said}</span>
    </span>
  );
}
