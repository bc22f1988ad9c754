/** The dialog of a step test: size, repetitions, duration, what will move, and the press that moves it. */

import { signal } from "@preact/signals";
import type { StepTestOptions } from "../api/lab-types";
import { type KnownServo, nameOf } from "../bench/fleet";
import { angle, number, signed, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { sheetOf } from "../bench/parameters";
import { limitsOf } from "../bench/servo-condition";
import { Confirm } from "../kit/confirm";
import { Dial } from "../kit/dial";
import { TextField } from "../kit/field";
import { Note } from "../kit/note";
import { GateNotes, gateOf } from "../servo/motion-gate";
import { closeDialog } from "./dialogs";
import { between, mostOf } from "./entries";
import { stagedGains, startStep, testing } from "./state";
import { GAINS, hornPathOf, testDuration } from "./step-runs";
import { tune as words } from "./words";

const MOST_DEG = 45;

/** Entries, stored while the page is open, so that a step can be repeated. */
const typed = { step: signal("10"), runs: signal("1"), dwell: signal("1"), note: signal("") };

export type StepOptions = Required<Pick<StepTestOptions, "step_deg" | "runs" | "dwell_s" | "note">>;

/** The entries as a step test; null if one is invalid. */
export function stepOptions(): StepOptions | null {
  const step = between(typed.step.value, "°", -MOST_DEG, MOST_DEG);
  const count = between(typed.runs.value, "", 1, 20);
  const dwell = between(typed.dwell.value, "s", 0.3, 10);
  if (step === null || Math.abs(step) < 0.1 || count === null || !Number.isInteger(count) || dwell === null)
    return null;
  return { step_deg: step, runs: count, dwell_s: dwell, note: typed.note.value.trim() };
}

/** "+10°", for buttons. */
export function stepName({ step_deg }: StepOptions): string {
  return withUnit(signed(step_deg, step_deg % 1 === 0 ? 0 : 1), "°");
}

/** Why a step cannot be run, in words; null if it can. */
export function againstStep(one: KnownServo, options: StepOptions | null): string | null {
  const strings = words.step;
  const present = angleNow(one);
  const at = present.stale ? null : present.value;
  const limits = limitsOf(one.uid);
  const drafts = sheetOf(one.uid).drafts.map.value;
  if (between(typed.step.value, "°", -MOST_DEG, MOST_DEG) === null || options?.step_deg === 0)
    return strings.stepWrong;
  if (between(typed.runs.value, "", 1, 20) === null) return strings.runsWrong;
  if (between(typed.dwell.value, "s", 0.3, 10) === null) return strings.dwellWrong;
  if (options === null) return strings.stepWrong;
  if (at === null) return strings.unknownAngle;
  const path = hornPathOf(at, options.step_deg, limits);
  if (path.outside && limits) return strings.outside(angle(path.to), angle(limits.ccw), angle(limits.cw));
  if (GAINS.some(key => drafts.get(key)?.verdict.ok === false)) return strings.wrongGain;
  return null;
}

export function StepDialog({ one }: { one: KnownServo }) {
  const strings = words.step;
  const options = stepOptions();
  const against = againstStep(one, options);
  const { on, able } = gateOf(one);
  const present = angleNow(one);
  const limits = limitsOf(one.uid);
  const path =
    options && present.value !== null && !present.stale
      ? hornPathOf(present.value, options.step_deg, limits)
      : null;
  const gains = stagedGains(one.uid).size;
  const name = options ? stepName(options) : "";
  return (
    <Confirm
      title={strings.dialogTitle(nameOf(one))}
      verb={(on
        ? gains > 0
          ? strings.applyAndGo
          : strings.go
        : gains > 0
          ? strings.enableApplyAndGo
          : strings.enableAndGo)(name)}
      doing={strings.starting}
      danger
      ready={against === null && (on || able) && !testing.value}
      testid="step-dialog"
      actId="step-go"
      act={() => (options ? startStep(one.uid, options) : undefined)}
      onClose={closeDialog}
    >
      <div class="tune-fields">
        <TextField
          label={strings.size}
          unit="°"
          number
          at={typed.step}
          error={wrong("step")}
          testid="step-deg"
        />
        <TextField
          label={strings.runs}
          unit=""
          number
          at={typed.runs}
          error={wrong("runs")}
          testid="step-runs"
        />
        <TextField
          label={strings.dwell}
          unit="s"
          number
          at={typed.dwell}
          error={wrong("dwell")}
          testid="step-dwell"
        />
        <TextField
          label={strings.note}
          hint={strings.notePlace}
          at={typed.note}
          longest={200}
          class="tune-note"
          testid="step-note"
        />
      </div>
      <div class="what-moves">
        <Dial
          size={112}
          angle={present.value}
          limits={limits}
          stale={present.stale}
          {...(path && !path.outside ? { sweep: { from: path.from, to: path.to } } : {})}
        />
        <div>
          {path && options && !path.outside && (
            <p data-testid="step-moves">
              <b>{strings.moves(angle(path.from), angle(path.to))}</b>
              {strings.times(
                options.runs,
                seconds(testDuration(options.runs, options.dwell_s)),
                mostOf(one.uid),
              )}
            </p>
          )}
          <Note kind="warning" testid="step-against">
            {against}
          </Note>
          <p class="second small">{gains > 0 ? strings.writesGains(gains) : strings.writes}</p>
          {!on && <p class="second small">{strings.enables}</p>}
        </div>
      </div>
      <GateNotes one={one} />
    </Confirm>
  );
}

function wrong(which: "step" | "runs" | "dwell"): boolean {
  if (which === "step") return (between(typed.step.value, "°", -MOST_DEG, MOST_DEG) ?? 0) === 0;
  if (which === "dwell") return between(typed.dwell.value, "s", 0.3, 10) === null;
  const count = between(typed.runs.value, "", 1, 20);
  return count === null || !Number.isInteger(count);
}

function seconds(s: number): string {
  return withUnit(number(s, s < 10 && s % 1 !== 0 ? 1 : 0), "s");
}
