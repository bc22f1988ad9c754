/** What a step of a job is called and what it found, by code; the server's words where the page has none. */
import { Problem } from "../api/client";
import type { Job, JobStep, Params } from "../api/types";
import { factsOf } from "../form/facts";
import { text } from "../text";
import { steps as words } from "../text/topics";

/** `bare`: without the servo's name. */
export function stepText(kind: Job["kind"], step: JobStep, bare = false): string {
  const name = words.steps[kind]?.[step.code];
  const servo = step.params?.servo;
  if (name === undefined) return step.text;
  return bare || servo === undefined ? name : words.of(String(servo), name);
}

/** What a step found; `over`: without what it said of steps to come. */
export function evidenceText(step: JobStep, over: boolean): string {
  const { evidence, evidence_code: code, evidence_params: params, ahead } = step;
  if (!evidence) return "";
  if (code === "problem") return whyFailed(evidence, params ?? {});
  const known = code == null ? undefined : words.evidence[code];
  if (known !== undefined) {
    const { horn, ...found } = factsOf(params);
    return known(over ? found : { ...found, horn });
  }
  return over && ahead && evidence.endsWith(ahead) ? evidence.slice(0, -ahead.length).trim() : evidence;
}

/** A problem by its code where the page has words for it; they say less than the server's, which come first in English. */
function whyFailed(evidence: string, params: Params): string {
  const problem = new Problem(String(params.problem), 0, evidence, params);
  return words.evidence.problem === undefined ? problem.message : text.problem(problem);
}
