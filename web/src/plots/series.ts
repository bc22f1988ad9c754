/**
 * Paths of a plot's series. Each curve has its own times, which uPlot's aligned table would have to join again for
 * every drawing; these path builders read the typed arrays directly.
 */
import type uPlot from "uplot";
import { shape } from "./shapes";
import { firstAt, inSight, isMany, type Samples, thin } from "./trace";

export interface PlotCurve {
  /** Samples from a time on; live curves read them from a ring. */
  samples: (from: number) => Samples;
  /** Index of a series colour, or the colour of a single measured curve or of a command. */
  colour: number | "ink" | "intent";
  /** Commands are dashed, measured curves never. */
  dashed?: boolean;
  /** Whether each value holds until the next one. */
  held?: boolean;
  /** Interrupted where samples are missing; a number: for at least this many seconds. */
  gaps?: boolean | number;
  /** Degrees on a circle: interrupted where it wraps. */
  wraps?: boolean;
  bold?: boolean;
  faint?: boolean;
  /** Whether the area below is tinted. */
  filled?: boolean;
  /** Key for highlighting. */
  key?: string;
  /** Letter in a box at the curve. */
  tag?: string;
  /** Where the letter is, if not at the usual place: x, and whether above the curve. */
  tagAt?: { x: number; above: boolean };
  /** Index of the shape of its samples; without one they are dots, with `plain` nothing. */
  shape?: number;
  plain?: boolean;
  /** Ends in an open dot: nothing reliable follows. */
  open?: boolean;
  /** Name at its end, or in the readout. */
  name?: string;
}

/** Samples closer than this are never a gap: a response may be late, and a line across it is short. */
export const NEVER_GAP_S = 0.35;
const GAP_INTERVALS = 3;
const HALF_TURN = 180;
/** A command may step over most of the circle; a horn cannot between two samples. */
const COMMAND_TURN = 300;

/**
 * Whether samples are missing between a sample and the previous one: their distance is three times that of their
 * neighbours. The rule needs no rate, since a plot may span several.
 */
export function isGap(t: Float64Array, at: number, never = NEVER_GAP_S): boolean {
  const here = (t[at] ?? 0) - (t[at - 1] ?? 0);
  if (!(here > never)) return false;
  const before = at >= 2 ? (t[at - 1] ?? 0) - (t[at - 2] ?? 0) : Number.POSITIVE_INFINITY;
  const after = at + 1 < t.length ? (t[at + 1] ?? 0) - (t[at] ?? 0) : Number.POSITIVE_INFINITY;
  const usual = Math.min(before, after);
  return Number.isFinite(usual) && here > GAP_INTERVALS * usual;
}

/** Whether an angle wrapped at ±180° between two samples. */
export function isWrap(before: number, value: number, command = false): boolean {
  return Math.abs(value - before) > (command ? COMMAND_TURN : HALF_TURN);
}

/** Pixels of a value, without a call into the plot per sample. */
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
  /** End of the line; null if it ended before the visible part. */
  end: { x: number; y: number } | null;
}

/** Columns of a plot: pixels of the page. */
function columnsOf(plot: uPlot): number {
  return Math.max(50, Math.round(plot.bbox.width / (devicePixelRatio || 1)));
}

/** Whether every visible sample of a curve is a point of its line, which has no dashes and no area. */
export function isPlain(plot: uPlot, at: Projection, curve: PlotCurve): boolean {
  if (curve.dashed || curve.held || curve.filled) return false;
  const [first, end] = inSight(curve.samples(at.min).t, at.min, at.max);
  return !isMany(end - first, columnsOf(plot));
}

/** Where a plain line ends; null without data at its last sample. */
export function endOf(at: Projection, curve: PlotCurve): CurveDrawn["end"] {
  const { t, v } = curve.samples(at.min);
  const [, end] = inSight(t, at.min, at.max);
  const value = v[end - 1] ?? Number.NaN;
  return Number.isNaN(value) ? null : { x: at.x(t[end - 1] ?? 0), y: at.y(value) };
}

/** The line through the visible samples; of a plain one only the part from a time on, and a little before. */
export function linePath(plot: uPlot, at: Projection, curve: PlotCurve, since = at.min): CurveDrawn {
  const one = curve.samples(at.min);
  const { t, v } = one;
  const columns = columnsOf(plot);
  const [visible, last] = inSight(t, at.min, at.max);
  const first = Math.max(visible, firstAt(t, since) - 2);
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
      // A held value extends to the wrap, and the next one to now.
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

/** A symbol at every sample where there is space; else, for curves with shapes, at some of them. */
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
  // Shapes of coinciding curves are offset.
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
