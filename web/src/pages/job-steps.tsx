/** Owns the list of a job's steps with their evidence, as commissioning, profiles and reports show it. */
import type { JobStep } from "../api/types";
import { withUnit } from "../form/format";
import { textOf } from "../state/commission-units";
import { text } from "../text";
import { Glyph } from "../ui/glyph";
import { Icon, Spinner } from "../ui/icon";

interface Props {
  steps: readonly JobStep[];
  label: string;
  /** Under the name of its servo a step need not say it again. */
  bare?: boolean;
}

export function JobSteps({ steps, label, bare = false }: Props) {
  return (
    <ol class="job-steps" aria-label={label}>
      {steps.map(step => (
        <li
          key={step.name}
          class={`step ${step.state}`}
          data-testid={`step-${step.name}`}
          data-state={step.state}
        >
          <Mark state={step.state} />
          <span class="step-text">
            <span class={step.state === "running" || step.state === "failed" ? "strong" : ""}>
              {bare ? textOf(step) : step.text}
            </span>
            {step.evidence && <small class="second">{step.evidence}</small>}
          </span>
          <span class="small dim">{took(step)}</span>
          <span class="hidden-text">{text.job.stepState[step.state]}</span>
        </li>
      ))}
    </ol>
  );
}

function took(step: JobStep): string {
  if (step.started_at == null || step.ended_at == null) return "";
  return withUnit((step.ended_at - step.started_at).toFixed(2), "s");
}

function Mark({ state }: { state: JobStep["state"] }) {
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
