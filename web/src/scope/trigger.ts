/** The trigger: where a curve crosses a level, and what the scope does then. */
import type { Samples } from "../plots/trace";
import { firstAt } from "../plots/trace";

export const EDGES = ["rising", "falling", "either"] as const;
export type Edge = (typeof EDGES)[number];
export const MODES = ["run", "single", "pause"] as const;
export type Mode = (typeof MODES)[number];

export interface TriggerRule {
  level: number;
  edge: Edge;
  /** Part of the window before the instant, 0 to 1. */
  before: number;
  /** Nothing fires for so long after it fired, s. */
  holdoff: number;
}

/**
 * When a curve first crosses the level after a time; null while it does not. Touching the level from the level itself is
 * no crossing, nor is a step over a gap. `held`: the value changes at the later sample, else in a straight line.
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
  /** Follows; no trigger is set. */
  | { state: "free" }
  | { state: "waiting"; since: number }
  /** Fired, and the window is not full yet. */
  | { state: "filling"; at: number }
  | { state: "triggered"; at: number }
  | { state: "paused" };

/** What comes next at a time of the server: fired, filled, or armed again once the holdoff is over. */
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

/** The part of time a shot shows, from its instant. */
export function windowOf(
  at: number,
  rule: TriggerRule,
  seconds: number,
): { from: number; to: number; zero: number } {
  return { from: at - rule.before * seconds, to: at + (1 - rule.before) * seconds, zero: at };
}
