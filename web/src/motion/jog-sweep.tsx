/** The sweep tab of the jog pad: ends, speed, pause and cycles, a description, and progress. */
import { useSignal } from "@preact/signals";
import { angle, number, withUnit } from "../bench/format";
import { up } from "../bench/link";
import { type AllowedSpan, check } from "../bench/number";
import type { Limits } from "../bench/servo-condition";
import { Button } from "../kit/button";
import { TextField, Tick } from "../kit/field";
import { Note } from "../kit/note";
import { endSweep, startSweep, sweep, sweepDuration, sweepResult } from "./sweep";
import { jogging as words } from "./words";

const SPEED: AllowedSpan = { unit: "°/s", perUnit: 10, minimum: 1, maximum: 360 };
const PAUSE: AllowedSpan = { unit: "s", perUnit: 10, minimum: 0, maximum: 60 };
const COUNT: AllowedSpan = { unit: "", perUnit: 1, minimum: 1, maximum: 10_000 };
/** Default ends: half of the limits, at most this. */
const FIRST_DEG = 30;

export function JogSweep({ limits, able }: { limits: Limits | null; able: boolean }) {
  const span: AllowedSpan = {
    unit: "°",
    perUnit: 10,
    minimum: limits?.ccw ?? null,
    maximum: limits?.cw ?? null,
    limits: "angle",
  };
  const from = useSignal(number(Math.max(-FIRST_DEG, (limits?.ccw ?? 0) / 2), 1));
  const to = useSignal(number(Math.min(FIRST_DEG, (limits?.cw ?? 0) / 2), 1));
  const speed = useSignal("60");
  const pause = useSignal("0.5");
  const count = useSignal("5");
  const free = useSignal(false);
  const going = sweep.value;
  const verdicts = [
    check(from.value, span),
    check(to.value, span),
    check(speed.value, SPEED),
    check(pause.value, PAUSE),
    check(count.value, COUNT),
  ];
  const wrong = verdicts.find(one => !one.ok);
  const [a = 0, b = 0, fast = 0, rest = 0, times = 0] = verdicts.map(one => (one.ok ? one.value : 0));
  const settings = { from: a, to: b, speed: fast, pause_s: rest, count: times };
  const ready = able && up.value && limits !== null && wrong === undefined && a !== b;

  if (going !== null) {
    return (
      <div class="sweep" data-testid="sweep" data-running="true">
        <p class="sweep-progress" role="status" data-testid="sweep-progress">
          <b>{words.progress(going.done, going.count)}</b>{" "}
          <span class="second">{words.going(angle(going.goal))}</span>
        </p>
        <progress max={going.count} value={going.done} aria-label={words.tab.sweep} />
        <p class="small second">{words.sweepEnds}</p>
        <Button testid="sweep-end" onClick={() => void endSweep()}>
          {words.stop}
        </Button>
      </div>
    );
  }
  return (
    <div class="sweep" data-testid="sweep" data-running="false">
      <div class="sweep-form">
        <TextField number label={words.from} unit="°" testid="sweep-from" at={from} />
        <TextField number label={words.to} unit="°" testid="sweep-to" at={to} />
        <TextField number label={words.speed} unit="°/s" testid="sweep-speed" at={speed} />
        <TextField number label={words.pause} unit="s" testid="sweep-pause" at={pause} />
        <TextField number label={words.count} unit="×" testid="sweep-count" at={count} />
      </div>
      {wrong !== undefined && !wrong.ok ? (
        <Note testid="sweep-against">
          {wrong.what} {wrong.remedy}
        </Note>
      ) : (
        <p data-testid="sweep-moves">
          {words.moves(
            angle(a),
            angle(b),
            times,
            `${withUnit(number(fast, 0), "°")}/s`,
            words.seconds(number(Math.ceil(sweepDuration(settings)), 0)),
          )}{" "}
          {limits && words.within(angle(limits.ccw), angle(limits.cw))}
        </p>
      )}
      {sweepResult.value !== null && (
        <p class="strong" role="status" data-testid="sweep-result">
          {sweepResult.value}
        </p>
      )}
      <div class="sweep-go">
        <Tick label={words.sweepFree} at={free} testid="sweep-free" />
        <Button
          look="primary"
          testid="sweep-start"
          live
          disabled={!ready || !free.value}
          onClick={() => void startSweep(settings)}
        >
          {words.start}
        </Button>
      </div>
      <p class="small second">{words.sweepEnds}</p>
    </div>
  );
}
