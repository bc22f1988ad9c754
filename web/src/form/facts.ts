/** The values of a code of the server as text: numbers with the unit that their names end in, and names of rows. */
import { Problem } from "../api/client";
import type { Params } from "../api/types";
import { text } from "../text";
import { angle, MINUS, withUnit } from "./format";
import { labelOf } from "./row-text";

/** By name. What the server left out, because it is unknown or does not apply, is undefined; false is, too. */
export type Facts = Readonly<Record<string, string | undefined>>;
/** A sentence from facts. */
export type Saying = (facts: Facts) => string;

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
  return params?.problem === undefined ? facts : { ...facts, problem: text.problem(problemIn(params)) };
}

/** The problem that is told among other values: its code is the value `problem`. */
export function problemIn(params: Params): Problem {
  return new Problem(String(params.problem), 0, String(params.summary ?? ""), params);
}

function said(name: string, value: Params[string]): string | undefined {
  if (typeof value === "boolean") return value ? text.on : undefined;
  if (Array.isArray(value))
    return value.length > 0 ? value.map(each => said(name, each)).join(text.comma) : undefined;
  if (typeof value === "object") return undefined;
  if (typeof value === "string") return name === "key" || name === "keys" ? labelOf(value) : value;
  const unit = name.slice(name.lastIndexOf("_") + 1);
  if (unit === "deg" && name !== unit) return angle(value);
  const digits = String(Math.round(value * 100) / 100).replace("-", MINUS);
  // The sentence says "a second" of a rate.
  return withUnit(digits, name === unit || name.endsWith("_per_s") ? "" : (UNITS[unit] ?? ""));
}
