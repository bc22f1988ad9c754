/** Values at a time: the sample taken there, or nothing in a gap; and the next sample. */
import { isGap } from "./series";
import { firstAt, nearestSample, type Samples } from "./trace";

/** Value of the sample nearest to a time; null in a gap. */
export function valueAtTime(one: Samples, at: number): number | null {
  const after = firstAt(one.t, at);
  const index = nearestSample(one, at);
  if (index < 0) return null;
  const inside = after > 0 && after < one.t.length;
  if (!inside && Math.abs((one.t[index] ?? 0) - at) > 0.5) return null;
  if (inside && (one.t[after] ?? 0) !== at && isGap(one.t, after)) return null;
  const value = one.v[index] ?? Number.NaN;
  return Number.isNaN(value) ? null : value;
}

/** Time of the sample a number of places after (or before) a time; the time itself without samples. */
export function stepFrom(one: Samples, at: number, places: number): number {
  const here = nearestSample(one, at);
  if (here < 0) return at;
  const next = Math.min(one.t.length - 1, Math.max(0, here + places));
  return one.t[next] ?? at;
}
