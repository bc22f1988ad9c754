/** Name and evidence of a step of a job, by code; the server's words if there are none. */
import type { Job, JobStep, Params, PlanStep } from "../api/types";
import { factsOf } from "../bench/facts";
import { steps as words } from "./words";

/** `bare`: without the servo's name. */
export function stepText(kind: Job["kind"], step: JobStep, bare = false): string {
  const number = kind === "plan" ? step.params?.step : undefined;
  const name =
    number === undefined
      ? words.steps[kind]?.[step.code]
      : words.numbered(Number(number), planStepText(step.code as PlanStep["do"], step.params ?? {}));
  const servo = step.params?.servo;
  if (name === undefined) return step.text;
  return bare || servo === undefined ? name : words.of(String(servo), name);
}

/** "Move to +10.0°". */
export function planStepText(kind: PlanStep["do"], values: Params): string {
  return words.planned[kind](factsOf(values));
}

/** Evidence of a step; `over`: without evidence about later steps. */
export function evidenceText(step: JobStep, over: boolean): string {
  const { evidence, evidence_code: code, evidence_params: params, ahead } = step;
  if (!evidence) return "";
  if (code === "problem" && words.evidence.problem === undefined) return String(params?.summary ?? evidence);
  const known = code == null ? undefined : words.evidence[code];
  if (known !== undefined) {
    const { horn, ...found } = factsOf(params);
    return known(over ? found : { ...found, horn });
  }
  return over && ahead && evidence.endsWith(ahead) ? evidence.slice(0, -ahead.length).trim() : evidence;
}
