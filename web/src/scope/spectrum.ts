/** Amplitude spectrum of a curve between two times: even samples, mean removed, Hann window, FFT. */
import { NEVER_GAP_S } from "../plots/series";
import { firstAt, type Samples } from "../plots/trace";

export interface Spectrum {
  /** Frequency, Hz, and amplitude of a sine in the unit of the curve. */
  t: Float64Array;
  v: Float64Array;
  /** Resolution, Hz: one over the duration. */
  resolution: number;
}

export interface Peak {
  hz: number;
  amplitude: number;
}

const LEAST_SAMPLES = 16;
const MOST_SAMPLES = 65_536;
/** Zero padding: finer steps for drawing and peak search, not a finer resolution. */
const PADDED = 4;
/** Width of the lobe of the mean, in steps of the resolution. */
const NEAR_ZERO = 2;

/** Null with too few samples or with a gap. */
export function spectrumOf(one: Samples, from: number, to: number): Spectrum | null {
  const low = Math.max(Math.min(from, to), one.t[0] ?? 0);
  const high = Math.min(Math.max(from, to), one.t.at(-1) ?? 0);
  const taken = firstAt(one.t, high) - firstAt(one.t, low);
  const step = (high - low) / Math.max(1, taken);
  const count = Math.min(MOST_SAMPLES, Math.floor((high - low) / step));
  if (!(count >= LEAST_SAMPLES)) return null;
  const even = evenly(one, low, step, count);
  if (!even) return null;
  let mean = 0;
  for (const value of even) mean += value / count;
  let size = 1;
  while (size < count * PADDED) size *= 2;
  const re = new Float64Array(size);
  const im = new Float64Array(size);
  for (let i = 0; i < count; i++) {
    const hann = 0.5 - 0.5 * Math.cos((2 * Math.PI * i) / count);
    re[i] = ((even[i] ?? 0) - mean) * hann;
  }
  fft(re, im);
  const half = size / 2;
  const t = new Float64Array(half);
  const v = new Float64Array(half);
  for (let i = 0; i < half; i++) {
    t[i] = i / (size * step);
    // The window halves the sum, and a sine appears at its frequency and at the negative one.
    v[i] = (4 / count) * Math.hypot(re[i] ?? 0, im[i] ?? 0);
  }
  return { t, v, resolution: 1 / (count * step) };
}

/** The highest peak above the lobe of the mean; null without one. */
export function highestPeak(one: Spectrum): Peak | null {
  let best = -1;
  for (let i = 1; i + 1 < one.v.length; i++) {
    const here = one.v[i] ?? 0;
    const top = here >= (one.v[i - 1] ?? 0) && here > (one.v[i + 1] ?? 0);
    if (top && (one.t[i] ?? 0) >= NEAR_ZERO * one.resolution && here > (one.v[best] ?? 0)) best = i;
  }
  if (best < 0) return null;
  const [a, b, c] = [one.v[best - 1] ?? 0, one.v[best] ?? 0, one.v[best + 1] ?? 0];
  const off = (a - c) / (2 * (a - 2 * b + c) || 1);
  return { hz: (best + off) * (one.t[1] ?? 0), amplitude: b - ((a - c) * off) / 4 };
}

/** Values at even times, interpolated linearly; null across a gap. */
function evenly(one: Samples, from: number, step: number, count: number): Float64Array | null {
  const out = new Float64Array(count);
  let i = Math.max(1, firstAt(one.t, from));
  for (let k = 0; k < count; k++) {
    const at = from + k * step;
    while (i < one.t.length - 1 && (one.t[i] ?? 0) < at) i++;
    const [t0, t1] = [one.t[i - 1] ?? 0, one.t[i] ?? 0];
    const [v0, v1] = [one.v[i - 1] ?? Number.NaN, one.v[i] ?? Number.NaN];
    if (Number.isNaN(v0) || Number.isNaN(v1) || t1 - t0 > Math.max(NEVER_GAP_S, 3 * step)) return null;
    out[k] = v0 + (v1 - v0) * Math.min(1, Math.max(0, (at - t0) / (t1 - t0 || 1)));
  }
  return out;
}

/** In-place FFT; the length is a power of two. */
export function fft(re: Float64Array, im: Float64Array): void {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [re[i], re[j]] = [re[j] ?? 0, re[i] ?? 0];
      [im[i], im[j]] = [im[j] ?? 0, im[i] ?? 0];
    }
  }
  for (let width = 2; width <= n; width *= 2) {
    const half = width / 2;
    for (let k = 0; k < half; k++) {
      const cos = Math.cos((-2 * Math.PI * k) / width);
      const sin = Math.sin((-2 * Math.PI * k) / width);
      for (let i = k; i < n; i += width) {
        const j = i + half;
        const x = (re[j] ?? 0) * cos - (im[j] ?? 0) * sin;
        const y = (re[j] ?? 0) * sin + (im[j] ?? 0) * cos;
        re[j] = (re[i] ?? 0) - x;
        im[j] = (im[i] ?? 0) - y;
        re[i] = (re[i] ?? 0) + x;
        im[i] = (im[i] ?? 0) + y;
      }
    }
  }
}
