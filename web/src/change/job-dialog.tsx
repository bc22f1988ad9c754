/** The progress of a save: a time scale, the steps in past tense with their evidence, and how it ended. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Job, JobStep } from "../api/types";
import { now } from "../bench/clock";
import { endText } from "../bench/facts";
import { angleOf, nameOf, servo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { ended, jobs } from "../bench/jobs";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { text } from "../text";
import { saving } from "./apply";
import { evidenceText, stepText } from "./step-text";

/** What a save usually takes; the scale grows when it takes longer. */
const USUAL_S = 3;

export function JobDialog({ uid }: { uid: string }) {
  const present = saving.value;
  if (!present || present.uid !== uid || !present.shown) return null;
  const job = jobs.value.get(present.job);
  return job ? <Progress job={job} values={present.keys.length} /> : null;
}

function Progress({ job, values }: { job: Job; values: number }) {
  const one = servo(job.uid);
  const name = nameOf(one);
  const over = ended(job);
  const elapsed = useElapsed(job, over);
  const hide = () => {
    const present = saving.peek();
    if (present) saving.value = { ...present, shown: false };
  };
  const at = job.steps.findIndex(step => step.state === "running");
  const title = !over
    ? text.job.title(name)
    : job.state === "succeeded"
      ? text.job.done(name)
      : unsure(job)
        ? text.job.unsure(name)
        : text.job.failed(name);
  const subtitle = !over
    ? text.job.keepOn
    : job.state === "succeeded"
      ? text.job.doneText(values)
      : endText(job);
  return (
    <Dialog
      title={title}
      subtitle={<span class={job.state === "failed" ? "k-failure" : ""}>{subtitle}</span>}
      testid="job-dialog"
      onClose={hide}
      foot={
        <>
          <span class="small second">
            {over ? text.job.state[job.state] : text.job.step(Math.max(1, at + 1), job.steps.length)}
          </span>
          <span class="grow" />
          <span data-first-focus>
            <Button testid="job-close" onClick={hide}>
              {over ? text.job.close : text.job.hide}
            </Button>
          </span>
        </>
      }
    >
      <div class="job" data-job-state={job.state}>
        <TimeScale elapsed={elapsed} over={over} />
        <ol>
          {job.steps.map(step => (
            <Step key={step.name} step={step} job={job} />
          ))}
        </ol>
      </div>
    </Dialog>
  );
}

// Once the servo was told to write, only what is read back tells what ROM holds.
function unsure(job: Job): boolean {
  return job.steps.some(step => step.name === "write" && step.state === "done");
}

// Times of the job are the server's; while it runs, our own clock since the dialog saw it tells how long.
function useElapsed(job: Job, over: boolean): number {
  const began = useSignal(now.peek());
  useEffect(() => {
    began.value = now.peek();
  }, [job.id]);
  if (over && job.ended_at !== null) return Math.max(0, job.ended_at - job.created_at);
  return Math.max(0, now.value - began.value);
}

const WIDTH = 630;

/** Once the job is over, the scale ends where the job did. */
function TimeScale({ elapsed, over }: { elapsed: number; over: boolean }) {
  const whole = over ? Math.max(elapsed, 0.1) : Math.max(USUAL_S, Math.ceil(elapsed));
  const minor = whole > 10 ? 1 : 10;
  const x = (s: number) => (s * WIDTH) / whole;
  let path = `M0 9H${WIDTH}`;
  for (let i = 0; i <= whole * minor; i++) path += `M${x(i / minor)} ${i % minor === 0 ? 0 : 5}V9`;
  const every = Math.max(1, Math.ceil(whole / 6));
  const seconds = Array.from({ length: Math.floor(whole / every) + 1 }, (_, i) => i * every);
  // A mark that would run into the one at the end is left out.
  const marks = over ? [...seconds.filter(mark => x(mark) < WIDTH - 56), whole] : seconds;
  return (
    <svg
      class="time-scale"
      data-testid="time-scale"
      width="100%"
      viewBox={`-2 -1 ${WIDTH + 4} 32`}
      aria-hidden="true"
    >
      <path d={path} stroke="var(--edge)" fill="none" />
      <path
        data-testid="time-bar"
        d={`M0 12H${x(over ? whole : Math.min(elapsed, whole))}`}
        stroke="var(--ink)"
        stroke-width="4"
      />
      {marks.map(mark => (
        <text
          key={mark}
          x={x(mark)}
          y="28"
          text-anchor={mark === 0 ? "start" : mark === whole ? "end" : "middle"}
          font-size="12"
          fill="var(--ink-2)"
        >
          {withUnit(number(mark, Number.isInteger(mark) ? 0 : 1), "s")}
        </text>
      ))}
    </svg>
  );
}

function Step({ step, job }: { step: JobStep; job: Job }) {
  const one = servo(job.uid);
  const running = step.state === "running";
  const failed = step.state === "failed";
  const never = step.state === "waiting" && ended(job);
  const live =
    running && step.code === "soft_start" && one
      ? text.job.liveAngle(angle(angleOf(one, now.value).value))
      : "";
  const took =
    step.started_at != null && step.ended_at != null
      ? withUnit((step.ended_at - step.started_at).toFixed(2), "s")
      : "";
  const under = [live, evidenceText(step, ended(job))].filter(Boolean).join(" ");
  return (
    <li class={`step ${step.state}`} data-testid={`step-${step.name}`} data-state={step.state}>
      <StepMark state={step.state} />
      <span class="step-text">
        <span class={running || failed ? "strong" : ""}>
          {failed ? text.job.notConfirmed(stepText(job.kind, step)) : stepText(job.kind, step)}
        </span>
        {under !== "" && <small class="second">{under}</small>}
      </span>
      <span class="small dim">
        {never ? text.job.never : step.state === "skipped" ? text.job.stepState.skipped : took}
      </span>
      {!never && <span class="hidden-text">{text.job.stepState[step.state]}</span>}
    </li>
  );
}

function StepMark({ state }: { state: JobStep["state"] }) {
  if (state === "done") {
    return (
      <span class="k-ok">
        <Icon name="tick" size={16} />
      </span>
    );
  }
  if (state === "running") {
    return (
      <span class="k-intent">
        <Spinner />
      </span>
    );
  }
  if (state === "failed") return <Glyph kind="failure" />;
  return <span class="ring" data-skipped={state === "skipped"} aria-hidden="true" />;
}
