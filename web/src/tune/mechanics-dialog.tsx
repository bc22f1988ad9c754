/** The dialog of a measurement of mechanics: what to measure, where the horn moves, and the press that moves it. */
import { signal } from "@preact/signals";
import type { MechanicsOptions, MechanicsTest } from "../api/lab-types";
import type { KnownServo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { limitsOf } from "../bench/servo-condition";
import { inSet, TextField, Tick } from "../kit/field";
import { between } from "./entries";
import { MeasureDialog } from "./measure-dialog";
import { startMechanics } from "./state";
import { tune as words } from "./words";

/** backlash is measured with friction. */
const TESTS = ["friction", "deadband", "repeatability", "speed", "travel", "end_stops"] as const;

const chosen = signal<ReadonlySet<MechanicsTest>>(new Set(["friction", "deadband", "repeatability"]));
const typed = { reach: signal("20"), torque: signal("60"), speed: signal("60") };

const LEAST_DEG = 16;
const LARGEST_DEG = 170;

export function MechanicsDialog({ one }: { one: KnownServo }) {
  const strings = words.mechanics;
  const reach = between(typed.reach.value, "°", 8, 170);
  const torque = between(typed.torque.value, "%", 10, 100);
  const speed = between(typed.speed.value, "rpm", 5, 150);
  const present = angleNow(one);
  const at = present.stale ? null : present.value;
  const limits = limitsOf(one.uid);
  const tests = TESTS.filter(test => chosen.value.has(test));
  const sweep =
    at === null || reach === null
      ? null
      : {
          from: Math.round(10 * Math.max(at - reach, limits?.ccw ?? -LARGEST_DEG, -LARGEST_DEG)) / 10,
          to: Math.round(10 * Math.min(at + reach, limits?.cw ?? LARGEST_DEG, LARGEST_DEG)) / 10,
        };
  const against =
    tests.length === 0
      ? strings.noTests
      : reach === null
        ? strings.reachWrong
        : torque === null
          ? strings.torqueWrong
          : speed === null
            ? strings.speedWrong
            : sweep === null
              ? words.step.unknownAngle
              : sweep.to - sweep.from < LEAST_DEG
                ? strings.noRoom
                : null;
  const body: MechanicsOptions | null =
    sweep === null || torque === null || speed === null
      ? null
      : { tests: [...tests], from_deg: sweep.from, to_deg: sweep.to, torque_pct: torque, speed_rpm: speed };
  return (
    <MeasureDialog
      one={one}
      name="mechanics"
      title={strings.dialogTitle}
      verbs={[strings.go, strings.enableAndGo]}
      act={() => (body ? startMechanics(one.uid, body) : undefined)}
      against={against}
      sweep={sweep}
      moves={
        sweep &&
        torque !== null && (
          <>
            <b>{strings.moves(angle(sweep.from), angle(sweep.to))}</b>
            {strings.most(withUnit(number(torque, 0), "%"))}
          </>
        )
      }
      lines={
        <>
          <p class="second small">{strings.writes}</p>
          {chosen.value.has("end_stops") && <p class="second small">{strings.stops}</p>}
        </>
      }
    >
      <div class="tune-tests" role="group" aria-label={strings.tests}>
        {TESTS.map(test => (
          <Tick
            key={test}
            label={strings.test[test]}
            at={inSet(chosen, test)}
            testid={`mechanics-test-${test}`}
          />
        ))}
      </div>
      <div class="tune-fields">
        <TextField
          label={strings.reach}
          unit="°"
          number
          at={typed.reach}
          error={reach === null}
          testid="mechanics-reach"
        />
        <TextField
          label={words.improve.torque}
          unit="%"
          number
          at={typed.torque}
          error={torque === null}
          testid="mechanics-torque"
        />
        <TextField
          label={words.improve.speed}
          unit="rpm"
          number
          at={typed.speed}
          error={speed === null}
          testid="mechanics-speed"
        />
      </div>
    </MeasureDialog>
  );
}
