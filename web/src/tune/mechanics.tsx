/** Mechanics of a servo. */
import type { KnownServo } from "../bench/fleet";
import { tune as words } from "./words";

export function MechanicsPart({ one }: { one: KnownServo }) {
  return (
    <section class="tune-part" data-testid="mechanics" data-uid={one.uid}>
      <p class="second">{words.mechanics.nothing}</p>
    </section>
  );
}
