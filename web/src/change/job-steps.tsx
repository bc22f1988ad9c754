/** The list of a job's steps with their evidence, as commissioning, profiles and reports show it. */
import type { Job, JobStep } from "../api/types";
import { now } from "../bench/clock";
import { angleOf, servo } from "../bench/fleet";
import { angle, withUnit } from "../bench/format";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { text } from "../text";
import { evidenceText, stepText } from "./step-text";

interface Props {
  /** The kind of their job. */
  kind: Job["kind"];
  steps: readonly JobStep[];
  label: string;
  /** What a step is called, where it is not by its code. */
  name?: (step: JobStep) => string;
  /** Under the name of its servo a step need not say it again. */
  bare?: boolean;
  /** What they did is in RAM only: no step of it is marked as well. */
  inRam?: boolean;
  /** The job has ended: what steps said of steps to come is past. */
  over?: boolean;
  /** Its servo, whose angle is shown while the horn turns. */
  uid?: string | null;
}

export function JobSteps({
  kind,
  steps,
  label,
  name,
  bare = false,
  inRam = false,
  over = false,
  uid,
}: Props) {
  return (
    <ol class="job-steps" aria-label={label}>
      {steps.map(step => {
        const called = name ? name(step) : stepText(kind, step, bare);
        const never = over && step.state === "waiting";
        const under = [liveAngle(step, uid ?? null), step.evidence ? evidenceText(step, over) : ""]
          .filter(Boolean)
          .join(" ");
        return (
          <li
            key={step.name}
            class={`step ${step.state}`}
            data-testid={`step-${step.name}`}
            data-state={step.state}
          >
            <Mark state={step.state} inRam={inRam} />
            <span class="step-text">
              <span class={step.state === "running" || step.state === "failed" ? "strong" : ""}>
                {step.state === "failed" ? text.job.notConfirmed(called) : called}
              </span>
              {under !== "" && <small class="second">{under}</small>}
            </span>
            <span class="small dim">
              {never ? text.job.never : step.state === "skipped" ? text.job.stepState.skipped : took(step)}
            </span>
            {!never && <span class="hidden-text">{text.job.stepState[step.state]}</span>}
          </li>
        );
      })}
    </ol>
  );
}

function liveAngle(step: JobStep, uid: string | null): string {
  if (uid === null || step.state !== "running" || step.code !== "soft_start") return "";
  const one = servo(uid);
  return one ? text.job.liveAngle(angle(angleOf(one, now.value).value)) : "";
}

function took(step: JobStep): string {
  if (step.started_at == null || step.ended_at == null) return "";
  return withUnit((step.ended_at - step.started_at).toFixed(2), "s");
}

function Mark({ state, inRam }: { state: JobStep["state"]; inRam: boolean }) {
  if (state === "done") {
    return (
      <span class={inRam ? "k-intent" : "k-ok"}>
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
