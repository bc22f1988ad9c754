/** A lane of a plot: curves of one unit on one axis, with its range and ticks. */

import type { TriggerLevel } from "./annotate";
import type { Samples } from "./trace";

export interface LaneCurve {
  uid: string;
  /** Channel. */
  channel: string;
  /** Name at the end of the curve and in readouts. */
  name: string;
  colour: number | "ink" | "intent";
  /** Commands are dashed, measured curves never. */
  dashed: boolean;
  /** Letter in a box before the name. */
  tag?: string;
  faint?: boolean;
  /** Samples of an overlaid file, instead of the store's. */
  samples?: (from: number) => Samples;
}

export interface Lane {
  unit: string;
  /** Decimals of values read. */
  decimals: number;
  curves: readonly LaneCurve[];
  /** Title in the corner. */
  title?: string;
  level?: TriggerLevel;
}

export function keyOf(curve: LaneCurve): string {
  return `${curve.uid}/${curve.channel}`;
}

/** Smallest height of a lane by its unit, so that noise does not fill it; its range moves in steps of half of it. */
const LEAST: Readonly<Record<string, number>> = { "°": 20, rpm: 20, "%": 20, "°C": 10, V: 2 };

/** Curves of one unit share a lane; lanes are in the order in which units occur. */
export function lanesOf(curves: readonly (LaneCurve & { unit: string; decimals: number })[]): Lane[] {
  const lanes = new Map<string, { unit: string; decimals: number; curves: LaneCurve[] }>();
  for (const { unit, decimals, ...curve } of curves) {
    const lane = lanes.get(unit) ?? { unit, decimals, curves: [] };
    lane.decimals = Math.max(lane.decimals, decimals);
    lane.curves.push(curve);
    lanes.set(unit, lane);
  }
  return [...lanes.values()];
}

/** A range around the curves: rounded, at least of the minimum height, unchanged while the curves stay inside. */
export function calmRange(
  drawn: readonly [number, number] | null,
  unit: string,
  before: readonly [number, number] | null,
): readonly [number, number] {
  const least = LEAST[unit] ?? 10;
  if (drawn === null) return before ?? [-least / 2, least / 2];
  const [low, high] = drawn;
  let step = least / 2;
  while ((high - low) / step > 20) step *= 5;
  const room = step / 5;
  let from = Math.floor((low - room) / step) * step;
  let to = Math.ceil((high + room) / step) * step;
  if (to - from < least) {
    from -= step;
    to += step;
  }
  const margin = before ? 0.04 * (before[1] - before[0]) : 0;
  const inside = before !== null && low >= before[0] + margin && high <= before[1] - margin;
  if (inside && before[1] - before[0] <= 2 * (to - from)) return before;
  return [from, to];
}

/** Round values between two limits, as many as fit. */
export function laneTicksOf(from: number, to: number, most: number): number[] {
  const rough = (to - from) / Math.max(1, most);
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * ([1, 2, 5, 10].find(one => one * ten >= rough - 1e-12) ?? 10);
  const ticks: number[] = [];
  for (let i = Math.ceil(from / step - 1e-9); i * step <= to + step * 1e-9; i++) ticks.push(i * step);
  return ticks;
}
