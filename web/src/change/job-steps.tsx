/** Steps of a job with their evidence, for commissioning, profiles and reports. */
import type { Job, JobStep } from "../api/types";
import { now } from "../bench/clock";
import { angleOf, servo } from "../bench/fleet";
import { angle, withUnit } from "../bench/format";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { text } from "../text";
import { evidenceText, stepText } from "./step-text";

interface Props {
  /** Kind of the job. */
  kind: Job["kind"];
  steps: readonly JobStep[];
  label: string;
  /** Name of a step, if not by its code. */
  name?: (step: JobStep) => string;
  /** Steps under the name of their servo need not repeat it. */
  bare?: boolean;
  /** RAM only: its steps are marked. */
  inRam?: boolean;
  /** The job has ended: evidence about later steps is outdated. */
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
