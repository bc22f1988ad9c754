/** The dialog of a step test: size, repetitions, duration, what will move, and the press that moves it. */

import { signal } from "@preact/signals";
import type { StepTestOptions } from "../api/lab-types";
import type { KnownServo } from "../bench/fleet";
import { angle, number, signed, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { sheetOf } from "../bench/parameters";
import { limitsOf } from "../bench/servo-condition";
import { TextField } from "../kit/field";
import { between, mostOf } from "./entries";
import { MeasureDialog } from "./measure-dialog";
import { stagedGains, startStep } from "./state";
import { GAINS, hornPathOf, testDuration } from "./step-runs";
import { tune as words } from "./words";

const MOST_DEG = 45;

/** Entries, stored while the page is open, so that a step can be repeated. */
const typed = { step: signal("10"), runs: signal("1"), dwell: signal("1"), note: signal("") };

export type StepOptions = Required<Pick<StepTestOptions, "step_deg" | "runs" | "dwell_s" | "note">>;

/** The entries; null for one that is invalid. */
function entries() {
  const step = between(typed.step.value, "°", -MOST_DEG, MOST_DEG);
  const runs = between(typed.runs.value, "", 1, 20);
  return {
    step: step !== null && Math.abs(step) >= 0.1 ? step : null,
    runs: runs !== null && Number.isInteger(runs) ? runs : null,
    dwell: between(typed.dwell.value, "s", 0.3, 10),
  };
}

/** The entries as a step test; null if one is invalid. */
export function stepOptions(): StepOptions | null {
  const { step, runs, dwell } = entries();
  if (step === null || runs === null || dwell === null) return null;
  return { step_deg: step, runs, dwell_s: dwell, note: typed.note.value.trim() };
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
  const { step, runs, dwell } = entries();
  if (step === null) return strings.stepWrong;
  if (runs === null) return strings.runsWrong;
  if (dwell === null || options === null) return strings.dwellWrong;
  if (at === null) return strings.unknownAngle;
  const path = hornPathOf(at, options.step_deg, limits);
  if (path.outside && limits) return strings.outside(angle(path.to), angle(limits.ccw), angle(limits.cw));
  if (GAINS.some(key => drafts.get(key)?.verdict.ok === false)) return strings.wrongGain;
  return null;
}

export function StepDialog({ one }: { one: KnownServo }) {
  const strings = words.step;
  const { step, runs, dwell } = entries();
  const options = stepOptions();
  const against = againstStep(one, options);
  const present = angleNow(one);
  const limits = limitsOf(one.uid);
  const path =
    options && present.value !== null && !present.stale
      ? hornPathOf(present.value, options.step_deg, limits)
      : null;
  const gains = stagedGains(one.uid).size;
  const name = options ? stepName(options) : "";
  return (
    <MeasureDialog
      one={one}
      name="step"
      title={strings.dialogTitle}
      verbs={
        gains > 0
          ? [strings.applyAndGo(name), strings.enableApplyAndGo(name)]
          : [strings.go(name), strings.enableAndGo(name)]
      }
      act={() => (options ? startStep(one.uid, options) : undefined)}
      against={against}
      sweep={path && !path.outside ? path : null}
      moves={
        path &&
        options && (
          <>
            <b>{strings.moves(angle(path.from), angle(path.to))}</b>
            {strings.times(
              options.runs,
              seconds(testDuration(options.runs, options.dwell_s)),
              mostOf(one.uid),
            )}
          </>
        )
      }
      lines={<p class="second small">{gains > 0 ? strings.writesGains(gains) : strings.writes}</p>}
    >
      <div class="tune-fields">
        <TextField
          label={strings.size}
          unit="°"
          number
          at={typed.step}
          error={step === null}
          testid="step-deg"
        />
        <TextField
          label={strings.runs}
          unit=""
          number
          at={typed.runs}
          error={runs === null}
          testid="step-runs"
        />
        <TextField
          label={strings.dwell}
          unit="s"
          number
          at={typed.dwell}
          error={dwell === null}
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
    </MeasureDialog>
  );
}

function seconds(s: number): string {
  return withUnit(number(s, s < 10 && s % 1 !== 0 ? 1 : 0), "s");
}
