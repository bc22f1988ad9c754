/** Parts of test plans: what a plan will do, and the progress of its job with End, Resume and reports. */
import { useSignal } from "@preact/signals";
import { problemOf } from "../api/client";
import type { Job, Params, PlanPreview, PlanStep, RunPlan } from "../api/types";
import { cautionText } from "../bench/caution-text";
import { problemText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { number, withUnit } from "../bench/format";
import { ended } from "../bench/jobs";
import { asProblem } from "../bench/parameters";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { whyRefused } from "./consequences";
import { type ChangeFlow, openChange } from "./flow";
import { endPlan, type PlanFacts, planResult, resumePlan } from "./plan-request";
import { ReportLinks } from "./report-links";
import { wordsOf } from "./safety-words";
import { planStepText } from "./step-text";
import { changing, steps } from "./words";

const strings = changing.plan;

export function PlanQuestion({ flow }: { flow: ChangeFlow }) {
  const found = (flow.request.facts as PlanFacts).preview.value;
  if (flow.request.kind === "plan-resume") return <p>{strings.moves}</p>;
  if (found === null) return null;
  const plan = found.plan as unknown as RunPlan;
  return (
    <>
      {plan.description !== "" && <p class="second">{plan.description}</p>}
      <p>
        {strings.size(found.cycles, found.steps, withUnit(number(found.least_s, 0), "s"))} {strings.moves}
      </p>
      <ol class="plan-steps" aria-label={strings.stepsLabel} data-testid="plan-steps">
        {plan.steps.map((step, at) => (
          <li key={String(at)}>{stepLine(plan, found, step, at + 1)}</li>
        ))}
      </ol>
      <p class="small second">
        {plan.profile != null && `${strings.profile(plan.profile)} `}
        {strings.limits(limitsOf(plan))} {strings.onLimit[plan.stop?.on_limit ?? "stop"]}
      </p>
      <ul class="plan-servos">
        {found.servos.map(one => (
          <li key={one.uid} data-testid={`plan-${one.uid}`} data-able={!one.problem}>
            <b>{nameOf(servo(one.uid)) || one.title}</b> <small class="second">{servo(one.uid)?.model}</small>
            {one.cautions.map(said => (
              <p key={said.code} class="small">
                <Glyph kind="notice" /> {cautionText(said, one.uid)}
              </p>
            ))}
            {one.problem && wordsOf(asProblem(one.problem)).length === 0 && (
              <Note>{whyRefused(asProblem(one.problem))}</Note>
            )}
          </li>
        ))}
      </ul>
    </>
  );
}

/** A step with the servos that take part, if not all. */
function stepLine(plan: RunPlan, found: PlanPreview, step: PlanStep, at: number): string {
  const titles = new Map(plan.servos.map((name, place) => [name, found.servos[place]?.title ?? name]));
  const of = (name: string) => titles.get(name) ?? name;
  if (step.do === "move" && typeof step.angle_deg === "object") {
    const each = Object.entries(step.angle_deg).map(([name, angle_deg]) =>
      steps.of(of(name), planStepText("move", { angle_deg })),
    );
    return steps.numbered(at, each.join(", "));
  }
  const said = planStepText(step.do, valuesOf(step));
  const some = step.do === "wait" ? null : step.servos;
  return steps.numbered(at, some == null ? said : steps.of(some.map(of).join(", "), said));
}

function valuesOf(step: PlanStep): Params {
  switch (step.do) {
    case "move":
      return { angle_deg: step.angle_deg as number };
    case "speed":
      return { rpm: step.speed_rpm, for_s: step.for_s };
    case "torque":
      return { torque_pct: step.torque_pct, for_s: step.for_s };
    default:
      return { for_s: step.for_s };
  }
}

function limitsOf(plan: RunPlan): string {
  const { limits } = plan;
  const one = (name: keyof typeof strings.quantity, value: number | null | undefined, unit: string) =>
    value == null
      ? []
      : [`${strings.quantity[name]} ${withUnit(number(value, value % 1 === 0 ? 0 : 1), unit)}`];
  return [
    ...one("error", limits?.position_error_deg ?? 1, "°"),
    ...one("temperature", limits?.temperature_c, "°C"),
    ...one("torque", limits?.torque_pct, "%"),
    ...one("least", limits?.voltage_min_v, "V"),
    ...one("most", limits?.voltage_max_v, "V"),
  ].join(", ");
}

/** Progress of the job of a plan, End or Resume, and its reports. */
export function PlanRun({ job }: { job: Job }) {
  const problem = useSignal<string | null>(null);
  const result = planResult(job);
  const over = ended(job);
  const end = async () => {
    problem.value = null;
    try {
      await endPlan(job);
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
  };
  return (
    <div class="plan-run" data-testid="plan-run" data-state={job.state}>
      {result !== null && (
        <p>
          <progress
            value={job.state === "succeeded" ? 1 : (job.progress ?? 0)}
            aria-label={strings.progress}
          />
          <span class="second">{strings.cycles(result.cycles_done, result.cycles)}</span>
        </p>
      )}
      <Note testid="plan-problem">{problem.value}</Note>
      <div class="plan-actions">
        {!over && (
          <Button look="danger" live testid="plan-end" onClick={() => void end()}>
            {strings.end}
          </Button>
        )}
        {over && job.resumable && (
          <Button live testid="plan-resume" onClick={() => void openChange(resumePlan(job))}>
            {strings.resume}
          </Button>
        )}
        {over && <ReportLinks job={job.id} title={strings.report} />}
      </div>
    </div>
  );
}
