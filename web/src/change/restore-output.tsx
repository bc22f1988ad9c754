/** The dialog that restores outputs: which servos, which are under load; then each is held where it is, step by step. */

import { useSignal } from "@preact/signals";
import { problemOf } from "../api/client";
import type { Job, JobStep, OutputRestorePreview } from "../api/types";
import { stop } from "../bench/bench";
import { failureText, problemText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { ended, jobs } from "../bench/jobs";
import { outputLine } from "../bench/output";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { restoring as said } from "../text/topics";
import { JobSteps } from "./job-steps";
import { able, type Prospect, planned, restore, restoredBy, toProblem } from "./restoring";
import "../kit/table.css";

const close = () => {
  planned.value = null;
};

export function RestoreDialog() {
  const plan = planned.value;
  return plan && <Opened plan={plan} />;
}

function Opened({ plan }: { plan: OutputRestorePreview }) {
  const running = useSignal<string | null>(null);
  return running.value === null ? (
    <Question
      plan={plan}
      onBegun={id => {
        running.value = id;
      }}
    />
  ) : (
    <Run id={running.value} kept={able(plan).some(one => one.needs_lease)} />
  );
}

function Question({ plan, onBegun }: { plan: OutputRestorePreview; onBegun: (id: string) => void }) {
  const busy = useSignal(false);
  const problem = useSignal<string | null>(null);
  const opened = useSignal(stop.peek()?.at ?? null).value;
  const again = stop.value?.latched === true && stop.value.at !== opened;
  const on = able(plan);
  const loaded = on.filter(one => one.under_load);
  const go = async () => {
    busy.value = true;
    problem.value = null;
    try {
      await restore(plan, onBegun);
    } catch (error) {
      problem.value = said.refused(problemText(problemOf(error)));
    }
    busy.value = false;
  };
  return (
    <Dialog
      title={said.title(on.length)}
      testid="restore-dialog"
      onClose={close}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={close}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="restore-go"
            disabled={busy.value || again}
            onClick={() => void go()}
          >
            {busy.value && <Spinner />}
            {said.go}
          </Button>
        </>
      }
    >
      <p>
        {plan.clears_stop && said.clears} {said.lead}
      </p>
      {loaded.length > 0 && (
        <p class="asked-back restore-load" role="alert" data-testid="restore-load">
          <Glyph kind="warning" size={18} />
          <span>{said.loaded(names(loaded), loaded.length)}</span>
        </p>
      )}
      <ul class="restore-list">
        {plan.servos.map(one => (
          <Line key={one.uid} one={one} />
        ))}
      </ul>
      {on.some(one => one.needs_lease) && <p class="second">{said.keeps}</p>}
      {(again || problem.value !== null) && (
        <p class="refusal" role="alert" data-testid="restore-refused">
          <Glyph kind="failure" size={14} /> {again ? said.again : problem.value}
        </p>
      )}
    </Dialog>
  );
}

function Line({ one }: { one: Prospect }) {
  const torque = one.torque_pct ?? 0;
  return (
    <li data-testid={`restore-${one.uid}`} data-load={one.under_load} data-able={!one.problem}>
      <b>{nameOf(servo(one.uid))}</b>
      <small class="second">{outputLine(one.output)}</small>
      {one.problem ? (
        <small class="strong k-failure">{said.stays(problemText(toProblem(one.problem)))}</small>
      ) : (
        one.under_load && (
          <small class="strong k-warning">
            {said.load}
            {torque !== 0 && `, ${said.torque(withUnit(number(Math.abs(torque), 0), "%"))}`}
          </small>
        )
      )}
    </li>
  );
}

function Run({ id, kept }: { id: string; kept: boolean }) {
  const job = jobs.value.get(id);
  if (!job) return null;
  const done = ended(job);
  const parts = restoredBy(job);
  const on = parts.filter(one => one.outcome === "on").length;
  const over = job.state === "succeeded" ? said.done(on) : said.failed(on, parts.length);
  return (
    <Dialog
      title={done ? over : said.running}
      subtitle={done ? undefined : said.stop}
      testid="restore-dialog"
      onClose={close}
      foot={
        <span data-first-focus>
          <Button testid="restore-close" onClick={close}>
            {done ? text.job.close : text.job.hide}
          </Button>
        </span>
      }
    >
      <div role="status" data-testid="restore-job" data-state={job.state}>
        <JobSteps kind={job.kind} steps={stepsOf(job)} name={nameOfStep} label={said.steps} over={done} />
        {job.error && (
          <p class="refusal">
            <Glyph kind="failure" size={14} /> {failureText(job.error)}
          </p>
        )}
      </div>
      {done && kept && on > 0 && <p class="second">{said.keeps}</p>}
    </Dialog>
  );
}

/** Its steps with the angle that each servo holds; one that failed says why. */
function stepsOf(job: Job): JobStep[] {
  const parts = restoredBy(job);
  return job.steps.map(step => {
    const at = parts.find(one => one.uid === step.uid)?.angle_deg;
    const held = step.state === "done" && at != null ? said.held(angle(at)) : null;
    return step.state === "failed" ? step : { ...step, evidence: held, evidence_code: null };
  });
}

function nameOfStep(step: JobStep): string {
  return step.uid ? nameOf(servo(step.uid)) : said.cleared;
}

function names(all: readonly Prospect[]): string {
  return all.map(one => nameOf(servo(one.uid))).join(", ");
}
