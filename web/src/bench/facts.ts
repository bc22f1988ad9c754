/** The values of a code of the server as text: numbers with the unit that their names end in, and names of rows. */
import { Problem } from "../api/client";
import type { Job, Params } from "../api/types";
import { text } from "../text";
import { codes } from "./codes";
import { angle, MINUS, withUnit } from "./format";
import { who } from "./holder";
import { rowLabelOf } from "./row-text";

/** By name. What the server left out, because it is unknown or does not apply, is undefined; false is, too. */
export type Facts = Readonly<Record<string, string | undefined>>;
/** A sentence from facts. */
export type Saying = (facts: Facts) => string;

/** What names rows. */
const KEYS: ReadonlySet<string> = new Set(["key", "keys", "limit", "not_restored", "other"]);

const UNITS: Readonly<Record<string, string>> = {
  s: "s",
  ms: "ms",
  v: "V",
  pct: "%",
  rpm: "rpm",
  hz: "Hz",
  mb: "MB",
};

export function factsOf(params: Params | undefined): Facts {
  const facts = Object.fromEntries(
    Object.entries(params ?? {}).map(([name, value]) => [name, said(name, value)]),
  );
  return params?.problem === undefined ? facts : { ...facts, problem: problemText(problemIn(params)) };
}

/** What went wrong, in the page's language. */
export function problemText(problem: Problem): string {
  const { problem: _nested, ...facts } = (problem.facts.params ?? problem.facts) as Params;
  const said = codes.value.problem?.(problem, { ...factsOf(facts), summary: problem.message });
  return said ?? who(text.problem(problem));
}

/** The same of what a job, an entry of a list or a message of the socket failed with. */
export function failureText(body: {
  code: string;
  summary?: string;
  detail?: string;
  params?: Params;
}): string {
  return problemText(new Problem(body.code, 0, body.summary ?? body.detail ?? "", { ...body }));
}

/** What a port or an adapter says is wrong, in the page's language. */
export function causeText(params: Params, otherwise: string): string {
  return codes.value.causes?.[String(params.cause ?? "")]?.(factsOf(params)) ?? otherwise;
}

/** Why a job did not succeed. */
export function endText(job: Job): string {
  return job.error ? failureText(job.error) : text.job.state[job.state];
}

/** The problem that is told among other values: its code is the value `problem`. */
export function problemIn(params: Params): Problem {
  return new Problem(String(params.problem), 0, String(params.summary ?? ""), params);
}

function said(name: string, value: Params[string] | null | object): string | undefined {
  if (typeof value === "boolean") return value ? text.on : undefined;
  if (Array.isArray(value))
    return value.length > 0 ? value.map(each => said(name, each)).join(text.comma) : undefined;
  if (typeof value === "object") return undefined;
  if (typeof value === "string") return KEYS.has(name) ? rowLabelOf(value) : value;
  const unit = name.slice(name.lastIndexOf("_") + 1);
  if (unit === "deg" && name !== unit) return angle(value);
  const digits = String(Math.round(value * 100) / 100).replace("-", MINUS);
  // The sentence says "a second" of a rate.
  return withUnit(digits, name === unit || name.endsWith("_per_s") ? "" : (UNITS[unit] ?? ""));
}
