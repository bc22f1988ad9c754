/** Consequences of a write that needs a confirmation, in the page's words. */

import type { Problem } from "../api/client";
import { problemText } from "../bench/facts";
import { withUnit } from "../bench/format";
import { rowLabelOf, valueText } from "../bench/row-text";
import { wordsOf } from "./safety-words";
import { editing } from "./words";

const strings = editing.confirm;

/** Consequence from the facts of the refusal; the server's sentence if they are missing. */
export function dangerOf(problem: Problem): string {
  const { key, requested, reading, margin, unit, confirm, choices, turns } = problem.facts;
  if (confirm === "torque_off_in_rom")
    return Array.isArray(choices) && choices.length > 1 ? strings.torqueUnknown : strings.torqueOff;
  if (typeof key !== "string" || typeof requested !== "number") return problemText(problem);
  const row = rowLabelOf(key);
  const wanted = valueText(key, requested);
  if (confirm === "multi_turn") return strings.turns(row, wanted, String(turns));
  if (typeof reading !== "number") return strings.unknown(row, wanted);
  const seen = withUnit(String(reading), String(unit));
  const about = withUnit(String(margin), String(unit));
  if (confirm === "supply") return strings.supply(row, wanted, seen, about);
  return confirm === "temperature" ? strings.temperature(row, wanted, seen, about) : problemText(problem);
}

/** Why a change was refused: the consequence if only a confirmation is missing, else the problem's text. */
export function whyRefused(problem: Problem): string {
  return wordsOf(problem).length === 0 ? problemText(problem) : dangerOf(problem);
}
