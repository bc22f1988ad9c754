/** Traces of a plot: samples in typed arrays, selection of visible ones, and decimation to the pixels. */

export interface Samples {
  t: Float64Array;
  /** NaN for a gap. */
  v: Float64Array;
}

/** Numbers from the server; null is a gap. */
export function samples(t: readonly number[], v: readonly (number | null)[], shift = 0, offset = 0): Samples {
  const made = { t: new Float64Array(t.length), v: new Float64Array(t.length) };
  for (let i = 0; i < t.length; i++) {
    made.t[i] = (t[i] ?? 0) - shift;
    const value = v[i];
    made.v[i] = value === null || value === undefined ? Number.NaN : value - offset;
  }
  return made;
}

/** Complete samples in the form a plot requests. */
export function still(one: Samples): () => Samples {
  return () => one;
}

/** The first index whose time is not before `at`; the length if there is none. */
export function firstAt(t: Float64Array, at: number): number {
  let low = 0;
  let high = t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((t[middle] ?? 0) < at) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Samples between two times, plus one at each side, so that lines reach the edges. */
export function inSight(t: Float64Array, from: number, to: number): [number, number] {
  return [Math.max(0, firstAt(t, from) - 1), Math.min(t.length, firstAt(t, to) + 1)];
}

/** Whether there are more samples than four per pixel column. */
export function isMany(count: number, columns: number): boolean {
  return count > 4 * columns;
}

/**
 * Indices to draw from `first` up to `end`: all of them while there are at most four per pixel column, else the
 * first, lowest, highest and last of each column. Every index is a real sample; gaps are preserved.
 */
export function thin(
  one: Samples,
  first: number,
  end: number,
  columns: number,
  span = (one.t[end - 1] ?? 0) - (one.t[first] ?? 0),
): Uint32Array {
  const count = Math.max(0, end - first);
  if (!isMany(count, columns)) return Uint32Array.from({ length: count }, (_, i) => first + i);
  // Columns are fixed in time: in a moving picture they would flicker otherwise.
  const width = Math.max(1e-9, span) / columns;
  const kept: number[] = [];
  let column = Number.NaN;
  // First, lowest, highest and last of the present column; -1 without any.
  const picks: [number, number, number, number] = [-1, -1, -1, -1];
  const flush = () => {
    const [earliest, low, high, latest] = picks;
    if (earliest < 0) return;
    let last = -1;
    for (const at of [earliest, Math.min(low, high), Math.max(low, high), latest]) {
      if (at > last) kept.push(at);
      last = at;
    }
    picks[0] = -1;
  };
  for (let i = first; i < end; i++) {
    const here = Math.floor((one.t[i] ?? 0) / width);
    const value = one.v[i] ?? Number.NaN;
    if (Number.isNaN(value)) {
      flush();
      kept.push(i);
      column = Number.NaN;
      continue;
    }
    if (here !== column) {
      flush();
      column = here;
      picks.fill(i);
      continue;
    }
    if (value < (one.v[picks[1]] ?? 0)) picks[1] = i;
    if (value > (one.v[picks[2]] ?? 0)) picks[2] = i;
    picks[3] = i;
  }
  flush();
  return Uint32Array.from(kept);
}

/** Lowest and highest value of several traces between two times; null without any. */
export function extent(traces: readonly Samples[], from: number, to: number): [number, number] | null {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const one of traces) {
    const [first, end] = inSight(one.t, from, to);
    for (let i = first; i < end; i++) {
      const value = one.v[i] ?? Number.NaN;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low > high ? null : [low, high];
}

/** Index of the sample nearest to a time; -1 without any. */
export function nearestSample(one: Samples, at: number): number {
  const after = firstAt(one.t, at);
  if (after >= one.t.length) return one.t.length - 1;
  if (after === 0) return 0;
  return at - (one.t[after - 1] ?? 0) < (one.t[after] ?? 0) - at ? after - 1 : after;
}
