/** Params of a code as text: numbers with the unit in their name, and names of rows. */
import { Problem } from "../api/client";
import type { Job, Params } from "../api/types";
import { text } from "../text";
import { codes } from "./codes";
import { angle, MINUS, number, withUnit } from "./format";
import { who } from "./holder";
import { rowLabelOf } from "./row-text";

/** By name. Undefined if unknown, not applicable or false. */
export type Facts = Readonly<Record<string, string | undefined>>;
/** A sentence made of facts. */
export type FactsText = (facts: Facts) => string;

/** Params that are keys of rows. */
const KEYS: ReadonlySet<string> = new Set(["key", "keys", "limit", "not_restored", "other"]);

/** Sizes in degrees, which have no direction and so no sign. */
const SIZES: ReadonlySet<string> = new Set([
  "amplitude_deg",
  "away_deg",
  "band_deg",
  "dead_band_deg",
  "error_deg",
  "backlash_deg",
  "largest_deg",
  "least_deg",
  "most_deg",
  "noise_deg",
  "step_deg",
  "moved_deg",
  "peak_to_peak_deg",
  "phase_margin_deg",
  "swing_deg",
]);

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
    Object.entries(params ?? {}).map(([name, value]) => [name, paramText(name, value)]),
  );
  return params?.problem === undefined ? facts : { ...facts, problem: problemText(problemIn(params)) };
}

/** Text of a problem in the page's language. */
export function problemText(problem: Problem): string {
  const { problem: _nested, ...facts } = (problem.facts.params ?? problem.facts) as Params;
  const sentence = codes.value.problem?.(problem, { ...factsOf(facts), summary: problem.message });
  return sentence ?? who(text.problem(problem));
}

/** Text of the failure of a job, a list entry or a socket message. */
export function failureText(body: {
  code: string;
  summary?: string;
  detail?: string;
  params?: Params;
}): string {
  return problemText(new Problem(body.code, 0, body.summary ?? body.detail ?? "", { ...body }));
}

/** Text of the cause reported by a port or adapter. */
export function causeText(params: Params, otherwise: string): string {
  return codes.value.causes?.[String(params.cause ?? "")]?.(factsOf(params)) ?? otherwise;
}

/** Why a job did not succeed. */
export function endText(job: Job): string {
  return job.error ? failureText(job.error) : text.job.state[job.state];
}

/** A problem nested in params: its code is the param `problem`. */
export function problemIn(params: Params): Problem {
  return new Problem(String(params.problem), 0, String(params.summary ?? ""), params);
}

function paramText(name: string, value: Params[string] | null | object): string | undefined {
  if (typeof value === "boolean") return value ? text.on : undefined;
  if (Array.isArray(value))
    return value.length > 0 ? value.map(each => paramText(name, each)).join(text.comma) : undefined;
  if (typeof value === "object") return undefined;
  if (typeof value === "string") return KEYS.has(name) ? rowLabelOf(value) : value;
  const unit = name.slice(name.lastIndexOf("_") + 1);
  if (SIZES.has(name)) return withUnit(number(value, 1), "°");
  if (unit === "deg" && name !== unit) return angle(value);
  const digits = String(Math.round(value * 100) / 100).replace("-", MINUS);
  // The sentence itself says "per second".
  return withUnit(digits, name === unit || name.endsWith("_per_s") ? "" : (UNITS[unit] ?? ""));
}
