/** Statistics of a curve between two cursors. */
import { isGap } from "../plots/series";
import { firstAt, type Samples } from "../plots/trace";

export interface Statistics {
  count: number;
  mean: number;
  /** Standard deviation of the samples. */
  sd: number;
  peakToPeak: number;
  /** Samples missing at the usual interval. */
  missing: number;
}

/** Statistics of the samples between two times, in either order, inclusive; null without any. */
export function statisticsOf(one: Samples, from: number, to: number): Statistics | null {
  const [low, high] = from <= to ? [from, to] : [to, from];
  let count = 0;
  let mean = 0;
  let squares = 0;
  let least = Number.POSITIVE_INFINITY;
  let most = Number.NEGATIVE_INFINITY;
  let missing = 0;
  const first = firstAt(one.t, low);
  const usual = intervalOf(one, low, high);
  for (let i = first; i < one.t.length && (one.t[i] ?? 0) <= high; i++) {
    const value = one.v[i] ?? Number.NaN;
    const apart = (one.t[i] ?? 0) - (one.t[i - 1] ?? 0);
    if (i > first && isGap(one.t, i)) missing += Math.max(0, Math.round(apart / usual) - 1);
    if (Number.isNaN(value)) {
      missing++;
      continue;
    }
    // Welford's algorithm: accurate for small spreads far from zero.
    count++;
    const off = value - mean;
    mean += off / count;
    squares += off * (value - mean);
    least = Math.min(least, value);
    most = Math.max(most, value);
  }
  if (count === 0) return null;
  const sd = count > 1 ? Math.sqrt(squares / (count - 1)) : 0;
  return { count, mean, sd, peakToPeak: most - least, missing };
}

/** The usual interval between two samples: the median; NaN with fewer than two. */
function intervalOf(one: Samples, from: number, to: number): number {
  const apart: number[] = [];
  for (let i = firstAt(one.t, from) + 1; i < one.t.length && (one.t[i] ?? 0) <= to; i++) {
    apart.push((one.t[i] ?? 0) - (one.t[i - 1] ?? 0));
  }
  apart.sort((a, b) => a - b);
  return apart[apart.length >> 1] ?? Number.NaN;
}
