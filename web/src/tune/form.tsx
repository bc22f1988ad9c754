/** The form of a step test, with a description of the move; progress and Cancel while it runs. */

import { useSignal } from "@preact/signals";
import { type KnownServo, nameOf } from "../bench/fleet";
import { angle, number, signed, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { parseNumber } from "../bench/number";
import { sheetOf } from "../bench/parameters";
import { limitsOf } from "../bench/servo-condition";
import { evidenceText, stepText } from "../change/step-text";
import { Button } from "../kit/button";
import { TextField } from "../kit/field";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { applyAndTest, cancelTest, stagedGains, test, testing, testProblem } from "./state";
import { GAINS, hornPathOf, testDuration } from "./step-runs";
import { tune as words } from "./words";

const strings = words.form;
const MOST_DEG = 45;

/** Last entries, stored while the page is open, so that a step can be repeated. */
const typed = { step: "5", runs: "1", dwell: "1", note: "" };

export function TuneForm({ one }: { one: KnownServo }) {
  const step = useSignal(typed.step);
  const runs = useSignal(typed.runs);
  const dwell = useSignal(typed.dwell);
  const note = useSignal(typed.note);
  Object.assign(typed, { step: step.value, runs: runs.value, dwell: dwell.value, note: note.value });
  const busy = testing.value;
  const present = angleNow(one);
  const at = present.stale ? null : present.value;
  const limits = limitsOf(one.uid);
  const stepDeg = within(step.value, "°", -MOST_DEG, MOST_DEG);
  const stepOk = stepDeg !== null && Math.abs(stepDeg) >= 0.1;
  const count = within(runs.value, "", 1, 20);
  const countOk = count !== null && Number.isInteger(count);
  const dwellS = within(dwell.value, "s", 0.3, 10);
  const path = at !== null && stepOk ? hornPathOf(at, stepDeg, limits) : null;
  const range = limits ? ([angle(limits.ccw), angle(limits.cw)] as const) : null;
  const sheet = sheetOf(one.uid);
  const gains = stagedGains(one.uid).size;
  const drafts = sheet.drafts.map.value;
  const wrongGain = GAINS.some(key => drafts.get(key)?.verdict.ok === false);
  const applying = sheet.busy.value !== null;
  const against = !stepOk
    ? strings.stepWrong
    : !countOk
      ? strings.runsWrong
      : dwellS === null
        ? strings.dwellWrong
        : path?.outside && range
          ? strings.outside(angle(path.to), ...range)
          : at === null && !busy
            ? strings.unknownAngle
            : wrongGain
              ? strings.wrongGain
              : null;
  const start = () => {
    if (!stepOk || !countOk || dwellS === null || against !== null || busy) return;
    void applyAndTest(one.uid, { step_deg: stepDeg, runs: count, dwell_s: dwellS, note: note.value.trim() });
  };
  return (
    <section class="tune-form" aria-label={strings.label}>
      <div class="tune-fields">
        <TextField
          label={strings.step}
          unit="°"
          number
          at={step}
          error={!stepOk}
          testid="step-deg"
          disabled={busy}
        />
        <TextField
          label={strings.runs}
          unit=""
          number
          at={runs}
          error={!countOk}
          testid="step-runs"
          disabled={busy}
        />
        <TextField
          label={strings.dwell}
          unit="s"
          number
          at={dwell}
          error={dwellS === null}
          testid="step-dwell"
          disabled={busy}
        />
        <TextField
          label={strings.note}
          hint={strings.notePlace}
          at={note}
          longest={200}
          class="tune-note"
          testid="step-note"
          disabled={busy}
        />
      </div>
      <div class="tune-go" {...(busy ? { "data-testid": "step-job" } : {})}>
        <div class="grow" aria-live="polite">
          {busy ? (
            <Progress />
          ) : (
            <>
              {path && countOk && dwellS !== null && (
                <p data-testid="step-moves">
                  <b>{strings.moves(nameOf(one), angle(path.from), angle(path.to))}</b>
                  {", "}
                  {strings.times(
                    count,
                    number(testDuration(count, dwellS), testDuration(count, dwellS) < 10 ? 1 : 0),
                  )}
                  {mostOf(one.uid)}. {range && strings.within(...range)}
                </p>
              )}
              {testProblem.value !== null ? (
                <Note testid="step-problem">{testProblem.value}</Note>
              ) : against !== null ? (
                <Note kind="warning" testid="step-against">
                  {against}
                </Note>
              ) : (
                <p class="second small">{gains > 0 ? strings.writesGains(gains) : strings.writes}</p>
              )}
            </>
          )}
        </div>
        {busy && (
          <Button look="danger" testid="step-cancel" live onClick={() => void cancelTest()}>
            {strings.cancel}
          </Button>
        )}
        <Button
          look="primary"
          testid="step-go"
          live
          disabled={against !== null || busy || applying}
          onClick={start}
        >
          {(gains > 0 ? strings.applyAndGo : strings.go)(
            stepOk ? withUnit(signed(stepDeg, stepDeg % 1 === 0 ? 0 : 1), "°") : "",
          )}
        </Button>
      </div>
    </section>
  );
}

/** The present step, in the space of the description, so that nothing below moves. */
function Progress() {
  const steps = test.value?.steps ?? [];
  const at = steps.findIndex(step => step.state === "running");
  const running = steps[at];
  return (
    <div class="tune-progress">
      <span class="k-intent">
        <Spinner />
      </span>
      <span>
        <b>{running ? stepText("step_test", running) : strings.running}</b>
        {at >= 0 && <span class="second"> {strings.stepOf(at + 1, steps.length)}</span>}
        <small class="second">{(running && evidenceText(running, false)) || strings.cancelHint}</small>
      </span>
    </div>
  );
}

function mostOf(uid: string): string {
  const sheet = sheetOf(uid);
  const largest = (one: string, other: string) => {
    const found = [sheet.held(one), sheet.held(other)].filter(value => typeof value === "number");
    return found.length === 2 ? Math.max(...found.map(Math.abs)) : null;
  };
  const rpm = largest("speed_limit_cw", "speed_limit_ccw");
  const pct = largest("torque_limit_cw", "torque_limit_ccw");
  if (rpm === null || pct === null) return strings.mostUnknown;
  return strings.most(withUnit(number(rpm, 0), "rpm"), withUnit(number(pct, 0), "%"));
}

function within(typedText: string, unit: string, low: number, high: number): number | null {
  const value = parseNumber(typedText, unit);
  return value === null || value < low || value > high ? null : value;
}
