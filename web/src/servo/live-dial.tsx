/** The live dial of a servo. */
import type { KnownServo } from "../bench/fleet";
import { angleNow } from "../bench/fresh";
import { limitsOf } from "../bench/servo-condition";
import { Dial } from "../kit/dial";

export function LiveDial({ one, size }: { one: KnownServo; size: number }) {
  const present = angleNow(one);
  return (
    <Dial
      size={size}
      angle={present.value}
      command={one.command_deg}
      limits={limitsOf(one.uid)}
      stale={present.stale}
    />
  );
}
