/** What a servo does now: its horn, where it is and should be, and its readings. */
import type { KnownServo } from "../bench/fleet";
import { angleNow } from "../bench/fresh";
import { limitsOf } from "../bench/servo-condition";
import { JogDial } from "../servo/command-dial";
import { Readouts } from "../servo/readouts";

export function Now({ one }: { one: KnownServo }) {
  const present = angleNow(one);
  return (
    <section class="o-now">
      <JogDial
        angle={present.value}
        command={one.command_deg}
        limits={limitsOf(one.uid)}
        stale={present.stale}
      />
      <Readouts uid={one.uid} />
    </section>
  );
}
