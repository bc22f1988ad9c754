/** Words that a write has to be confirmed with: which are asked for, which are agreed to, what is still open. */
import type { Problem } from "../api/client";
import type { SafetyWord } from "../api/config-types";

/** Answers to one question: what ROM gets as torque mode. One of them is enough, and one excludes the other. */
const TORQUE: ReadonlySet<SafetyWord> = new Set(["torque_on_in_rom", "torque_off_in_rom"]);

/** What a refusal asks for; several where one of them is to be chosen. None where it asks for nothing. */
export function wordsOf(problem: Problem): readonly SafetyWord[] {
  const { confirm, choices } = problem.facts;
  if (problem.code !== "needs_confirmation") return [];
  if (Array.isArray(choices) && choices.length > 0) return choices as SafetyWord[];
  return typeof confirm === "string" ? [confirm as SafetyWord] : [];
}

/** Whether something that is asked for has no answer yet. */
export function isOpen(asked: readonly SafetyWord[], agreed: readonly SafetyWord[]): boolean {
  const torque = agreed.some(word => TORQUE.has(word));
  return asked.some(word => !agreed.includes(word) && !(torque && TORQUE.has(word)));
}

/** What is agreed to after a tick was set or taken away. */
export function withTick(agreed: readonly SafetyWord[], word: SafetyWord, on: boolean): SafetyWord[] {
  const others = agreed.filter(one => one !== word && !(on && TORQUE.has(word) && TORQUE.has(one)));
  return on ? [...others, word] : others;
}
