/** Strokes every plot has in common: a curve with its gaps, the ground, ruled lines, dotted upright lines. */
import type uPlot from "uplot";
import type { Palette } from "./palette";
import { inSight, type Samples, thin } from "./trace";

/** Samples nearer than this are never a gap: an answer may be late, and a line across it is short. */
export const NEVER_GAP_S = 0.35;
const GAP_INTERVALS = 3;

/**
 * Whether nothing was sampled between a sample and the one before: they lie three times as far apart as their
 * neighbours. The rule needs no rate, for a plot may span several.
 */
export function isGap(t: Float64Array, at: number): boolean {
  const here = (t[at] ?? 0) - (t[at - 1] ?? 0);
  if (!(here > NEVER_GAP_S)) return false;
  const before = at >= 2 ? (t[at - 1] ?? 0) - (t[at - 2] ?? 0) : Number.POSITIVE_INFINITY;
  const after = at + 1 < t.length ? (t[at + 1] ?? 0) - (t[at] ?? 0) : Number.POSITIVE_INFINITY;
  const usual = Math.min(before, after);
  return Number.isFinite(usual) && here > GAP_INTERVALS * usual;
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
  path: Path2D;
  /** Where the line ends, null when it ended before what is in sight. */
  end: { x: number; y: number } | null;
  first: number;
  last: number;
}

/** The line through samples in sight. `held`: each value holds until the next. `gaps`: where nothing was sampled. */
export function curveOf(
  plot: uPlot,
  at: Projection,
  samples: Samples,
  { held = false, gaps = false }: { held?: boolean; gaps?: boolean } = {},
): CurveDrawn {
  const { t, v } = samples;
  const columns = Math.max(50, Math.round(plot.bbox.width / (devicePixelRatio || 1)));
  const [first, last] = inSight(t, at.min, at.max);
  const path = new Path2D();
  let down = false;
  let x = Number.NaN;
  let y = Number.NaN;
  for (const i of thin(samples, first, last, columns, at.max - at.min)) {
    const value = v[i] ?? Number.NaN;
    if (Number.isNaN(value)) {
      down = false;
      continue;
    }
    const lastY = y;
    x = at.x(t[i] ?? 0);
    y = at.y(value);
    if (!down || (gaps && i > first && isGap(t, i))) path.moveTo(x, y);
    else {
      if (held) path.lineTo(x, lastY);
      path.lineTo(x, y);
    }
    down = true;
  }
  return { path, end: down ? { x, y } : null, first, last };
}

export function ground(plot: uPlot, colours: Palette): void {
  const { ctx, bbox } = plot;
  // The plot remembers the style it set last and does not set it again.
  ctx.save();
  ctx.fillStyle = colours.well;
  ctx.fillRect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.restore();
}

/** Everything until `restore` stays inside the face of the plot. */
export function clip(plot: uPlot): void {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
}

/** An upright dotted line: cursors and marks, never data. */
export function upright(plot: uPlot, x: number, colour: string): void {
  const { ctx, bbox } = plot;
  const ratio = devicePixelRatio || 1;
  ctx.strokeStyle = colour;
  ctx.lineWidth = ratio;
  ctx.setLineDash([2 * ratio, 3 * ratio]);
  ctx.beginPath();
  ctx.moveTo(x, bbox.top);
  ctx.lineTo(x, bbox.top + bbox.height);
  ctx.stroke();
  ctx.setLineDash([]);
}

/** Level lines at the ticks, every second one dotted. */
export function ruled(
  plot: uPlot,
  ticks: readonly number[],
  y: (v: number) => number,
  colours: Palette,
): void {
  const { ctx, bbox } = plot;
  const ratio = devicePixelRatio || 1;
  ctx.strokeStyle = colours.line;
  ctx.lineWidth = ratio;
  ticks.forEach((tick, place) => {
    const at = Math.round(y(tick)) + 0.5;
    ctx.setLineDash(place % 2 === 0 ? [] : [2 * ratio, 3 * ratio]);
    ctx.beginPath();
    ctx.moveTo(bbox.left, at);
    ctx.lineTo(bbox.left + bbox.width, at);
    ctx.stroke();
  });
  ctx.setLineDash([]);
}

export function colourOf(colour: number | "ink" | "intent", colours: Palette): string {
  if (colour === "ink") return colours.ink;
  if (colour === "intent") return colours.intent;
  return colours.series[colour % colours.series.length] ?? colours.ink;
}
