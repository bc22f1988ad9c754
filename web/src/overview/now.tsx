/** What a servo does now: its horn, angle and command, and its readings. */
import { commandNow } from "../bench/activity";
import { now } from "../bench/clock";
import type { KnownServo } from "../bench/fleet";
import { age, angle, NONE, number, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { sheetOf } from "../bench/parameters";
import { limitsOf } from "../bench/servo-condition";
import { JogDial } from "../servo/command-dial";
import { Readout, Readouts } from "../servo/readouts";
import { overview as words } from "./words";

export function Now({ one }: { one: KnownServo }) {
  const present = angleNow(one);
  const command = commandNow(one.uid);
  const requested = command.kind === "angle" ? command.figure : null;
  // Only of a command and an angle that are both known now; the older one decides the age of the difference.
  const error = {
    value: requested?.value == null || present.value === null ? null : requested.value - present.value,
    age: present.age,
    stale: present.stale || requested?.stale !== false,
  };
  const held = sheetOf(one.uid).held("angle_dead_band");
  const band = typeof held === "number" ? held : null;
  const powered = one.bootAt === null ? null : Math.max(0, now.value - one.bootAt);
  return (
    <section class="o-now">
      <JogDial
        angle={present.value}
        command={one.command_deg}
        limits={limitsOf(one.uid)}
        stale={present.stale}
        series={one.series}
      />
      <Readouts uid={one.uid}>
        <Readout
          label={words.tracking}
          live={error}
          shown={error.value === null ? NONE : angle(error.value)}
          note={band === null ? "" : words.deadband(withUnit(number(band, 1), "°"))}
          testid="tracking-readout"
        />
        <Readout
          label={words.powered}
          live={{ value: powered, age: present.age, stale: !one.online || powered === null }}
          shown={powered === null ? NONE : lasted(powered)}
          testid="powered-readout"
        />
      </Readouts>
    </section>
  );
}

function lasted(seconds: number): string {
  const minutes = Math.floor(seconds / 60);
  return minutes === 0 ? age(seconds, 0) : words.lasted(Math.floor(minutes / 60), minutes % 60);
}
