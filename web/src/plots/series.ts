/**
 * The paths of a plot's series. Each curve has its own times, so uPlot's aligned table would have to be joined again for
 * every drawing; a path builder of our own reads the typed arrays as they are.
 */
import type uPlot from "uplot";
import { shape } from "./shapes";
import { inSight, type Samples, thin } from "./trace";

export interface PlotCurve {
  /** What there is from a time on; live curves read it out of a ring. */
  samples: (from: number) => Samples;
  /** A place among the series colours, or what is measured alone, or what was commanded. */
  colour: number | "ink" | "intent";
  /** Commands are dashed, measured curves never. */
  dashed?: boolean;
  /** Holds each value until the next one. */
  held?: boolean;
  /** Interrupted where nothing was sampled; a number: for longer than so many seconds, at least. */
  gaps?: boolean | number;
  /** Degrees round a circle: interrupted where it jumps from one end to the other. */
  wraps?: boolean;
  bold?: boolean;
  faint?: boolean;
  /** The area below is tinted. */
  filled?: boolean;
  /** What makes it stand out. */
  key?: string;
  /** In a box at the curve. */
  tag?: string;
  /** Place of the shape its samples have; without one they are dots, with `plain` nothing. */
  shape?: number;
  plain?: boolean;
  /** Stands at its end, or is said where a pointer is. */
  name?: string;
}

/** Samples nearer than this are never a gap: an answer may be late, and a line across it is short. */
export const NEVER_GAP_S = 0.35;
const GAP_INTERVALS = 3;
const HALF_TURN = 180;
/** A command may be a step over most of the circle; a horn does not get there between two samples. */
const COMMAND_TURN = 300;

/**
 * Whether nothing was sampled between a sample and the one before: they lie three times as far apart as their
 * neighbours. The rule needs no rate, for a plot may span several.
 */
export function isGap(t: Float64Array, at: number, never = NEVER_GAP_S): boolean {
  const here = (t[at] ?? 0) - (t[at - 1] ?? 0);
  if (!(here > never)) return false;
  const before = at >= 2 ? (t[at - 1] ?? 0) - (t[at - 2] ?? 0) : Number.POSITIVE_INFINITY;
  const after = at + 1 < t.length ? (t[at + 1] ?? 0) - (t[at] ?? 0) : Number.POSITIVE_INFINITY;
  const usual = Math.min(before, after);
  return Number.isFinite(usual) && here > GAP_INTERVALS * usual;
}

/** Whether an angle went through ±180° between two samples. */
export function isWrap(before: number, value: number, command = false): boolean {
  return Math.abs(value - before) > (command ? COMMAND_TURN : HALF_TURN);
}

/** Pixels of a value, without a call into the plot for each sample. */
export interface Projection {
  x: (t: number) => number;
  y: (v: number) => number;
  min: number;
  max: number;
}

export function projection(plot: uPlot, zero = 0): Projection {
  const { left, top, width, height } = plot.bbox;
  const min = plot.scales.x?.min ?? 0;
  const max = plot.scales.x?.max ?? 1;
  const low = plot.scales.y?.min ?? 0;
  const high = plot.scales.y?.max ?? 1;
  const across = width / (max - min || 1);
  const up = height / (high - low || 1);
  return {
    x: t => left + (t - zero - min) * across,
    y: v => top + height - (v - low) * up,
    min: min + zero,
    max: max + zero,
  };
}

export interface CurveDrawn {
  stroke: Path2D;
  fill: Path2D | null;
  /** Where the line ends, null when it ended before what is in sight. */
  end: { x: number; y: number } | null;
}

/** The line through the samples in sight. */
export function linePath(plot: uPlot, at: Projection, curve: PlotCurve): CurveDrawn {
  const one = curve.samples(at.min);
  const { t, v } = one;
  const columns = Math.max(50, Math.round(plot.bbox.width / (devicePixelRatio || 1)));
  const [first, last] = inSight(t, at.min, at.max);
  const stroke = new Path2D();
  const fill = curve.filled ? new Path2D() : null;
  const base = plot.bbox.top + plot.bbox.height;
  let down = false;
  let x = Number.NaN;
  let y = Number.NaN;
  let value = Number.NaN;
  const lift = () => {
    if (down) fill?.lineTo(x, base);
    down = false;
  };
  for (const i of thin(one, first, last, columns, at.max - at.min)) {
    const before = value;
    value = v[i] ?? Number.NaN;
    if (
      Number.isNaN(value) ||
      (curve.gaps && i > first && isGap(t, i, curve.gaps === true ? NEVER_GAP_S : curve.gaps)) ||
      (curve.wraps && isWrap(before, value, curve.dashed))
    ) {
      lift();
    }
    if (Number.isNaN(value)) continue;
    const lastY = y;
    const lastX = x;
    x = at.x(t[i] ?? 0);
    y = at.y(value);
    if (down) {
      if (curve.held) stroke.lineTo(x, lastY);
      stroke.lineTo(x, y);
      fill?.lineTo(x, y);
    } else {
      // What was held until an angle wrapped was held until now.
      if (curve.held && curve.wraps && isWrap(before, value, curve.dashed)) {
        stroke.moveTo(lastX, lastY);
        stroke.lineTo(x, lastY);
      }
      stroke.moveTo(x, y);
      fill?.moveTo(x, base);
      fill?.lineTo(x, y);
    }
    down = true;
  }
  const end = down ? { x, y } : null;
  lift();
  if (curve.held && end && !curve.gaps) stroke.lineTo(plot.bbox.left + plot.bbox.width, end.y);
  return { stroke, fill, end };
}

const DOTS_PX = 6;
const SHAPES_PX = 64;
const DOT = "M1.8 0A1.8 1.8 0 1 1 -1.8 0A1.8 1.8 0 1 1 1.8 0z";

/** Every sample where there is room for them; else, where curves have shapes, one now and then. */
export function pointsPath(plot: uPlot, at: Projection, curve: PlotCurve): Path2D | null {
  if (curve.dashed || curve.held || curve.plain) return null;
  const ratio = devicePixelRatio || 1;
  const { t, v } = curve.samples(at.min);
  const [first, end] = inSight(t, at.min, at.max);
  const apart = plot.bbox.width / ratio / Math.max(1, end - first);
  if (apart < DOTS_PX && curve.shape === undefined) return null;
  const every = apart >= DOTS_PX ? 0 : SHAPES_PX;
  const outline = new Path2D(curve.shape === undefined ? DOT : shape(curve.shape));
  const all = new Path2D();
  // Where curves lie on one another their shapes should not.
  let last = plot.bbox.left / ratio - SHAPES_PX / 2 + (curve.shape ?? 0) * (SHAPES_PX / 8);
  for (let i = first; i < end; i++) {
    const value = v[i] ?? Number.NaN;
    const x = at.x(t[i] ?? 0) / ratio;
    if (Number.isNaN(value) || (every > 0 && x - last < every)) continue;
    last = x;
    all.addPath(outline, new DOMMatrix().scale(ratio).translate(x, at.y(value) / ratio));
  }
  return all;
}
