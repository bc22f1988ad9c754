/** The trigger: where a curve crosses a level, and the resulting states of the scope. */
import type { Samples } from "../plots/trace";
import { firstAt } from "../plots/trace";

export const EDGES = ["rising", "falling", "either"] as const;
export type Edge = (typeof EDGES)[number];
export const MODES = ["run", "single", "pause"] as const;
export type Mode = (typeof MODES)[number];

export interface TriggerRule {
  level: number;
  edge: Edge;
  /** Share of the window before the instant, 0 to 1. */
  before: number;
  /** Time after firing in which it cannot fire again, s. */
  holdoff: number;
}

/**
 * First time after `after` at which the curve crosses the level, else null. Leaving the level is no crossing, nor is a
 * step across a gap. `held`: the value changes at the later sample, else linearly.
 */
export function crossing(one: Samples, rule: TriggerRule, after: number, held = false): number | null {
  const { t, v } = one;
  for (let i = Math.max(1, firstAt(t, after)); i < t.length; i++) {
    const low = v[i - 1] ?? Number.NaN;
    const high = v[i] ?? Number.NaN;
    const rises = low < rule.level && high >= rule.level;
    const falls = low > rule.level && high <= rule.level;
    if (!((rises && rule.edge !== "falling") || (falls && rule.edge !== "rising"))) continue;
    const from = t[i - 1] ?? 0;
    const to = t[i] ?? 0;
    const at = held ? to : from + ((rule.level - low) / (high - low)) * (to - from);
    if (at > after) return at;
  }
  return null;
}

export type Acquisition =
  /** Following, no trigger set. */
  | { state: "free" }
  | { state: "waiting"; since: number }
  /** Fired, the window is not full yet. */
  | { state: "filling"; at: number }
  | { state: "triggered"; at: number }
  | { state: "paused" };

/** Next state at a server time: fired, filled, or rearmed after the holdoff. */
export function step(
  before: Acquisition,
  now: number,
  mode: Mode,
  rule: TriggerRule,
  window: number,
  fired: (after: number) => number | null,
): Acquisition {
  if (mode === "pause") return { state: "paused" };
  if (before.state === "free" || before.state === "paused") return { state: "waiting", since: now };
  if (before.state === "waiting") {
    const at = fired(before.since);
    return at === null ? before : { state: "filling", at };
  }
  if (before.state === "filling") {
    const full = now >= before.at + (1 - rule.before) * window;
    return full ? { state: "triggered", at: before.at } : before;
  }
  const over = before.at + Math.max(rule.holdoff, (1 - rule.before) * window);
  if (mode === "single" || now < over) return before;
  const at = fired(over);
  return at === null ? before : { state: "filling", at };
}

/** The time span of a capture around its instant. */
export function windowOf(
  at: number,
  rule: TriggerRule,
  seconds: number,
): { from: number; to: number; zero: number } {
  return { from: at - rule.before * seconds, to: at + (1 - rule.before) * seconds, zero: at };
}
