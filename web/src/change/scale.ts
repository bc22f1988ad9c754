/** The ruled range of a row: its ends, and the position of a value. */
import type { AllowedSpan } from "../bench/number";

/** Ranges wider than this multiple of the used part are drawn only as far as used. */
const MUCH = 50;
const TURN = 180;

export interface Scale {
  low: number;
  high: number;
}

/**
 * The range to draw: the model's, unless it is so wide (angles may be millions of degrees) that all values would be at
 * one end; then half a turn, or as far as the values reach.
 */
export function scaleOf(span: AllowedSpan, values: readonly (number | null)[]): Scale | null {
  if (span.minimum === null || span.maximum === null || span.maximum <= span.minimum) return null;
  const used = values.flatMap(value => (value === null ? [] : [Math.abs(value)]));
  const widest = Math.max(Math.abs(span.minimum), Math.abs(span.maximum));
  const reach = Math.max(TURN, ...used);
  if (span.unit !== "°" || widest < MUCH * TURN) return { low: span.minimum, high: span.maximum };
  return { low: Math.max(span.minimum, -reach), high: Math.min(span.maximum, reach) };
}

/** 0 to 1 along the scale, clamped. */
export function placeOnScale(value: number, scale: Scale): number {
  return Math.min(1, Math.max(0, (value - scale.low) / (scale.high - scale.low)));
}

/** Steps of a drag: round values, about one per pixel. */
const STEPS = 100;

/** The value at a position (0 to 1) of the scale, rounded to a step. */
export function valueOnScale(place: number, scale: Scale): number {
  const span = scale.high - scale.low;
  const exact = scale.low + Math.min(1, Math.max(0, place)) * span;
  if (place <= 0 || place >= 1) return exact;
  const rough = span / STEPS;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map(one => one * power).find(one => one >= rough - 1e-9) ?? rough;
  return Math.min(scale.high, Math.max(scale.low, Number((Math.round(exact / step) * step).toFixed(6))));
}
