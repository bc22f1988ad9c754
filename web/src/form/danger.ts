/** Owns what could happen where the server asks back before a write, in the page's words. */
import type { Problem } from "../api/client";
import { toConfirm } from "../state/records";
import { text } from "../text";
import { editing } from "../text/topics";
import { withUnit } from "./format";
import { labelOf, valueText } from "./row-text";

const said = editing.confirm;

/** What could happen, from the facts of the refusal; the server's own sentence where they do not say. */
export function dangerOf(problem: Problem): string {
  const { key, requested, reading, margin, unit, confirm } = problem.facts;
  if (confirm === "torque_off_in_rom") return said.torqueOff;
  if (typeof key !== "string" || typeof requested !== "number") return problem.message;
  const row = labelOf(key);
  const wanted = valueText(key, requested);
  if (typeof reading !== "number") return said.unknown(row, wanted);
  const seen = withUnit(String(reading), String(unit));
  const about = withUnit(String(margin), String(unit));
  if (confirm === "supply") return said.supply(row, wanted, seen, about);
  return confirm === "temperature" ? said.temperature(row, wanted, seen, about) : problem.message;
}

/** Why something was refused: the danger where a tick is all that is missing, else what the page says of the code. */
export function whyRefused(problem: Problem): string {
  return toConfirm(problem) === null ? text.problem(problem) : dangerOf(problem);
}
