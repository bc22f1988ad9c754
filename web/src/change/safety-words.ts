/** Confirmation words of a write: required, given, and missing. */
import type { Problem } from "../api/client";
import type { SafetyWord } from "../api/config-types";

/** Alternative confirmations: torque mode in ROM. One of them is required, and they exclude each other. */
const TORQUE: ReadonlySet<SafetyWord> = new Set(["torque_on_in_rom", "torque_off_in_rom"]);

/** Words required by a refusal; several if one of them must be chosen. Empty if none. */
export function wordsOf(problem: Problem): readonly SafetyWord[] {
  const { confirm, choices } = problem.facts;
  if (problem.code !== "needs_confirmation") return [];
  if (Array.isArray(choices) && choices.length > 0) return choices as SafetyWord[];
  return typeof confirm === "string" ? [confirm as SafetyWord] : [];
}

/** True if a required confirmation is missing. */
export function isOpen(requested: readonly SafetyWord[], agreed: readonly SafetyWord[]): boolean {
  const torque = agreed.some(word => TORQUE.has(word));
  return requested.some(word => !agreed.includes(word) && !(torque && TORQUE.has(word)));
}

/** Given confirmations after a check box has changed. */
export function withTick(agreed: readonly SafetyWord[], word: SafetyWord, on: boolean): SafetyWord[] {
  const others = agreed.filter(one => one !== word && !(on && TORQUE.has(word) && TORQUE.has(one)));
  return on ? [...others, word] : others;
}
