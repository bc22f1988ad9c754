/** The running job in place of the column: its steps and Cancel; after its end, what the servo holds now. */
import type { ComponentChildren } from "preact";
import type { Job } from "../api/types";
import { type KnownServo, nameOf, servo } from "../bench/fleet";
import { ended } from "../bench/jobs";
import { resultText } from "../bench/note-text";
import { sheetOf } from "../bench/parameters";
import { go, pathOf } from "../bench/route";
import { rowLabelOf, valueText } from "../bench/row-text";
import { JobSteps } from "../change/job-steps";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { gainsOf } from "./legend";
import { cancelTest, dismissJob, failureOf, test, testing, testProblem } from "./state";
import { tune as words } from "./words";

export function JobPart({ one }: { one: KnownServo }) {
  const strings = words.job;
  const job = test.value;
  const running = testing.value;
  const over = job !== null && ended(job);
  const title = job ? strings.kinds[job.kind as keyof typeof strings.kinds] : strings.starting;
  return (
    <section
      class="tune-job"
      aria-label={title}
      data-testid={running ? "tune-job" : "tune-job-ended"}
      data-kind={job?.kind}
      data-state={job?.state}
    >
      <header>
        {running && (
          <span class="k-intent">
            <Spinner />
          </span>
        )}
        <h2>{title}</h2>
      </header>
      {over && job && <Ending job={job} one={one} />}
      <Note band testid="step-problem">
        {testProblem.value}
      </Note>
      {job && (
        <JobSteps
          kind={job.kind}
          steps={job.steps}
          label={strings.steps(nameOf(one))}
          over={over}
          uid={one.uid}
          bare={job.uid !== null}
        />
      )}
      <div class="tune-job-foot">
        {running ? (
          <>
            <p class="second small">{strings.ends}</p>
            <Button
              look="danger"
              testid="step-cancel"
              live
              disabled={job === null}
              onClick={() => void cancelTest()}
            >
              {strings.cancel}
            </Button>
          </>
        ) : (
          <>
            <Button testid="job-close" onClick={dismissJob}>
              {strings.close}
            </Button>
            {job?.kind === "improve" && one.unsaved.length > 0 && (
              <Button testid="job-keep" onClick={() => go(pathOf("parameters", one.uid))}>
                {words.gains.keep}
              </Button>
            )}
          </>
        )}
      </div>
    </section>
  );
}

/** How a job ended, and the gains that the servo holds now. */
function Ending({ job, one }: { job: Job; one: KnownServo }) {
  const failure = failureOf(job);
  const said: ComponentChildren = failure ?? (resultText(job.result) || null);
  return (
    <div class="tune-ending" role="status" data-testid="job-ending">
      {said !== null && (
        <p class="strong">
          <Glyph kind={failure === null ? "ok" : job.state === "cancelled" ? "notice" : "failure"} />
          <span>{said}</span>
        </p>
      )}
      <SetReport result={job.result as SetResult | null} />
      <Holds one={one} />
    </div>
  );
}

interface SetResult {
  spread?: Record<string, { least: number; most: number }>;
  outlier?: { uid: string; because: string } | null;
}

/** Spread of the gains of several servos, and the one that differs. */
function SetReport({ result }: { result: SetResult | null }) {
  const strings = words.improve;
  if (!result?.spread) return null;
  const { spread, outlier } = result;
  return (
    <>
      {outlier && (
        <Note kind="warning" testid="set-outlier">
          {strings.outlier(nameOf(servo(outlier.uid)), strings.because[outlier.because] ?? outlier.because)}
        </Note>
      )}
      <ul class="second small" data-testid="set-spread">
        {Object.entries(spread).map(([key, { least, most }]) => (
          <li key={key}>{strings.spread(rowLabelOf(key), valueText(key, least), valueText(key, most))}</li>
        ))}
      </ul>
    </>
  );
}

/** "Elevator L holds P 40, D 40, as in ROM." */
function Holds({ one }: { one: KnownServo }) {
  const strings = words.job;
  const sheet = sheetOf(one.uid);
  const held = gainsOf({
    parameters: {
      angle_p_gain: sheet.held("angle_p_gain") ?? null,
      angle_d_gain: sheet.held("angle_d_gain") ?? null,
    },
  });
  if (held === "") return null;
  const unsaved = one.unsaved.length > 0;
  return (
    <p class="second" data-testid="job-holds">
      {(unsaved ? strings.holdsRam : strings.holdsRom)(nameOf(one), held)}
    </p>
  );
}
