/** What a lane of a plot is: curves of one unit on one axis; its calm range and its ticks. */

import type { TriggerLevel } from "./annotate";
import type { Samples } from "./trace";

export interface LaneCurve {
  uid: string;
  /** The channel. */
  channel: string;
  /** Stands at the end of the curve, and in what is read of it. */
  name: string;
  colour: number | "ink" | "intent";
  /** Commands are dashed, measured curves never. */
  dashed: boolean;
  /** In a box before its name. */
  tag?: string;
  faint?: boolean;
  /** Not of the store: of a file laid over it. */
  samples?: (from: number) => Samples;
}

export interface Lane {
  unit: string;
  /** Of a value that is read. */
  decimals: number;
  curves: readonly LaneCurve[];
  /** Stands in its corner. */
  title?: string;
  level?: TriggerLevel;
}

export function keyOf(curve: LaneCurve): string {
  return `${curve.uid}/${curve.channel}`;
}

/** The least height of a lane by its unit, so that noise does not fill it; half of it is the step of its range. */
const LEAST: Readonly<Record<string, number>> = { "°": 20, rpm: 20, "%": 20, "°C": 10, V: 2 };

/** Curves of a unit share a lane, in the order in which units come. */
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

/** A calm range round what is drawn: round, at least so high, and steady while the curves stay inside. */
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

/** Round values between two, as many as there is room for. */
export function laneTicksOf(from: number, to: number, most: number): number[] {
  const rough = (to - from) / Math.max(1, most);
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * ([1, 2, 5, 10].find(one => one * ten >= rough - 1e-12) ?? 10);
  const ticks: number[] = [];
  for (let i = Math.ceil(from / step - 1e-9); i * step <= to + step * 1e-9; i++) ticks.push(i * step);
  return ticks;
}
