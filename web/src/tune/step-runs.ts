/** Results of step tests: letters of runs, the metrics table with errors, parameter differences. */
import type { StepMetrics, StepRun, StepTrace } from "../api/lab-types";
import type { Value } from "../api/types";
import { noteText } from "../bench/note-text";

export type Direction = StepTrace["direction"];

/** Rows to tune with a step test, in this order; a servo has those of its model and firmware. */
export const GAINS = [
  "angle_p_gain",
  "angle_d_gain",
  "angle_dead_band",
  "angle_boost",
  "smoothing",
  "overcurrent_limit",
] as const;

export const OVERLAID = 8;

/** The name of a run in an overlay: A is the oldest. */
export function letter(place: number): string {
  return String.fromCharCode(65 + place);
}

/** Selected runs in the order of their IDs, which is oldest first. */
export function runsInOrder(ids: Iterable<number>): number[] {
  return [...ids].sort((a, b) => a - b);
}

/** The selection after toggling a run; at most eight, beyond that the oldest is removed. */
export function toggled(ids: readonly number[], id: number): number[] {
  if (ids.includes(id)) return ids.filter(one => one !== id);
  return runsInOrder([...ids, id]).slice(-OVERLAID);
}

/** The runs to show first, of runs newest first: the newest, beside the one before it if both can be compared. */
export function shownFirst(runs: readonly StepRun[]): number[] {
  const [newest, before] = runs;
  if (newest === undefined) return [];
  const alike = before !== undefined && conditionsOf(newest) === conditionsOf(before);
  return runsInOrder(alike ? [before.id, newest.id] : [newest.id]);
}

/** The selection after a new run: A stays for comparison, unless more than two were selected to be overlaid. */
export function withNewest(ids: readonly number[], id: number): number[] {
  return ids.length > 2 ? toggled(ids, id) : runsInOrder([...ids.slice(0, 1), id]);
}

/** What must be equal in comparable runs; the server decides about those that are shown. */
function conditionsOf(run: StepRun): string {
  const { procedure, set_up, step_deg } = run;
  return JSON.stringify([procedure, step_deg, Object.entries(set_up).sort()]);
}

/** Whether two runs have the same gains and set-up, so that one letter names both. */
export function sameGains(
  one: Pick<StepRun, "parameters" | "set_up">,
  other: Pick<StepRun, "parameters" | "set_up">,
): boolean {
  const of = ({ parameters, set_up }: typeof one) =>
    JSON.stringify([GAINS.map(key => parameters[key] ?? null), Object.entries(set_up).sort()]);
  return of(one) === of(other);
}

export type MetricKey =
  | "delay_s"
  | "rise_s"
  | "crossing_s"
  | "overshoot_pct"
  | "settling_s"
  | "steady_state_error_deg"
  | "peak_speed_rpm";

export type MetricKind = "time" | "percent" | "angle" | "speed";

export const METRICS: Readonly<Record<MetricKey, MetricKind>> = {
  delay_s: "time",
  rise_s: "time",
  crossing_s: "time",
  overshoot_pct: "percent",
  settling_s: "time",
  steady_state_error_deg: "angle",
  peak_speed_rpm: "speed",
};

/** A metric of a run: median over the steps of a direction, and its spread. */
export interface MetricFigure {
  value: number;
  low: number;
  high: number;
  /** Number of steps that reached it. */
  reached: number;
  of: number;
}

export function stepsOf(run: StepRun, direction: Direction): StepTrace[] {
  return run.steps.filter(step => step.direction === direction);
}

/** Null if no step reached it. */
export function figure(run: StepRun, direction: Direction, key: MetricKey): MetricFigure | null {
  const steps = stepsOf(run, direction);
  const values = steps.flatMap(step => step.metrics[key] ?? []).sort((a, b) => a - b);
  const low = values[0];
  const high = values.at(-1);
  if (low === undefined || high === undefined) return null;
  const middle = values.length / 2;
  const value =
    values.length % 2 === 1
      ? (values[Math.floor(middle)] ?? low)
      : ((values[middle - 1] ?? low) + (values[middle] ?? low)) / 2;
  return { value, low, high, reached: values.length, of: steps.length };
}

/** Error of the times of a run, seconds: its largest gap between two samples. */
export function sampleOf(run: StepRun, direction: Direction): number {
  return Math.max(0, ...stepsOf(run, direction).map(step => step.metrics.sample_s));
}

const WORST: readonly StepMetrics["hunting"][] = ["none", "slight", "hunting"];

type Swing = Pick<StepMetrics, "hunting" | "hunting_hz" | "hunting_rms_deg" | "settling_s">;

/** Whether a swing is hunting: a slight one only if the horn did not settle. The server's verdict says the same. */
export function hunts(one: Swing | null | undefined): boolean {
  return one?.hunting === "hunting" || (one?.hunting === "slight" && one.settling_s === null);
}

/** The worst swing of the steps. */
export function hunting(run: StepRun, direction: Direction): Swing | null {
  const found = stepsOf(run, direction).map(step => step.metrics);
  const badness = (one: Swing) => Number(hunts(one)) * WORST.length + WORST.indexOf(one.hunting);
  found.sort((a, b) => badness(b) - badness(a));
  return found[0] ?? null;
}

export interface Compared {
  delta: number;
  /** The difference is within the errors of both. */
  within: boolean;
}

/** Difference of a metric between two runs. Times are accurate to one sample of each. */
export function compared(
  base: MetricFigure | null,
  other: MetricFigure | null,
  kind: MetricKind,
  error_s: number,
): Compared | null {
  if (!base || !other) return null;
  const delta = other.value - base.value;
  return { delta, within: kind === "time" && Math.abs(delta) <= error_s };
}

/** The gains of a run that differ from the servo's present ones. */
export function gainsToRestore(run: StepRun, held: (key: string) => Value | undefined): Map<string, Value> {
  const changes = new Map<string, Value>();
  for (const key of GAINS) {
    const then = run.parameters[key];
    const present = held(key);
    if (then === undefined || then === null || present === undefined || present === null) continue;
    if (then !== present) changes.set(key, then);
  }
  return changes;
}

/** The parameters that differ between runs, gains first. */
export function differing(differences: Readonly<Record<string, readonly Value[]>>): string[] {
  const rank = (key: string) => {
    const at = (GAINS as readonly string[]).indexOf(key);
    return at < 0 ? GAINS.length : at;
  };
  return Object.keys(differences).sort((a, b) => rank(a) - rank(b));
}

/** Warnings that a verdict says already. */
const SAID: Partial<Record<StepRun["verdict"]["code"], string>> = {
  smoothing_measured: "smoothing_on",
  limit_reached: "limit_reached",
};

/** Warnings of the overlaid runs, each once, with the letters of its runs. */
export function warned(runs: readonly StepRun[]): { line: string; letters: string[] }[] {
  const found = new Map<string, string[]>();
  runs.forEach((run, place) => {
    for (const { text, code, params } of run.warnings) {
      if (code === SAID[run.verdict.code]) continue;
      const line = noteText(text, code, params);
      found.set(line, [...(found.get(line) ?? []), letter(place)]);
    }
  });
  return [...found].map(([line, letters]) => ({ line, letters }));
}

export type Path = { from: number; to: number; outside: "cw" | "ccw" | null };

/** Start and end of a step, degrees, and the limit it would cross. */
export function hornPathOf(at: number, step: number, limits: { cw: number; ccw: number } | null): Path {
  const to = Math.round((at + step) * 10) / 10;
  const outside = limits === null ? null : to > limits.cw ? "cw" : to < limits.ccw ? "ccw" : null;
  return { from: at, to, outside };
}

/** Longest duration of a test, seconds: both directions, each for the dwell time. */
export function testDuration(runs: number, dwell_s: number): number {
  return 2 * runs * dwell_s;
}
