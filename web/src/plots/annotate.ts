/** Annotations of a plot beside its series: grid lines, bands, marks, cursors, names and letters. */
import type uPlot from "uplot";
import type { Palette } from "./palette";
import type { PlotCurve, Projection } from "./series";
import { nearestSample } from "./trace";

/** A band; with `low` equal to `high` a limit line. */
export interface Band {
  low: number;
  high: number;
  label: string;
}

export interface TriggerLevel {
  value: number;
  waiting: boolean;
}

export interface MarkAt {
  t: number;
  word: string;
}

/** A part of the time, or of another x, where nothing can be said. */
export interface Hatched {
  from: number;
  to: number;
  /** Shown where there is space. */
  word?: string;
}

/** Words at a point of a curve, with a line to it. */
export interface Callout {
  t: number;
  v: number;
  word: string;
  /** Distance of the words from the point, pixels; plus is to the right and down. */
  dx: number;
  dy: number;
}

/** Gap between the plot and the names beside it. */
export const NAME_GAP_PX = 9;
const NAME_PX = 14;
const TAG_PX = 18;

const dpr = () => devicePixelRatio || 1;

export function colourOf(colour: PlotCurve["colour"], colours: Palette): string {
  if (colour === "ink") return colours.ink;
  if (colour === "intent") return colours.intent;
  return colours.series[colour % colours.series.length] ?? colours.ink;
}

/** Background with level lines at the ticks, every second one dotted. */
export function ground(plot: uPlot, ticks: readonly number[], at: Projection, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  // The plot caches the style it set last.
  ctx.save();
  ctx.fillStyle = colours.well;
  ctx.fillRect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.strokeStyle = colours.line;
  ctx.lineWidth = ratio;
  ticks.forEach((tick, place) => {
    const y = Math.round(at.y(tick)) + 0.5;
    ctx.setLineDash(place % 2 === 0 ? [] : [2 * ratio, 3 * ratio]);
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
  });
  ctx.restore();
}

/** Clips to the face of the plot until `restore`. */
export function clip(plot: uPlot): void {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
}

/** A vertical dotted line for cursors and marks, never for data. */
export function upright(plot: uPlot, x: number, colour: string): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  ctx.strokeStyle = colour;
  ctx.lineWidth = ratio;
  ctx.setLineDash([2 * ratio, 3 * ratio]);
  ctx.beginPath();
  ctx.moveTo(Math.round(x), bbox.top);
  ctx.lineTo(Math.round(x), bbox.top + bbox.height);
  ctx.stroke();
  ctx.setLineDash([]);
}

export function drawBand(plot: uPlot, band: Band, at: Projection, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const top = at.y(band.high);
  ctx.fillStyle = colours.limit;
  ctx.globalAlpha = band.low === band.high ? 1 : 0.2;
  const height = Math.max(1.5 * ratio, at.y(band.low) - top);
  ctx.fillRect(bbox.left, top, bbox.width, height);
  ctx.globalAlpha = 1;
}

/** A dotted line with a triangle and a word at its foot. */
export function footMark(plot: uPlot, mark: MarkAt, at: Projection, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const x = at.x(mark.t);
  const low = bbox.top + bbox.height;
  upright(plot, x, colours.ink3);
  ctx.fillStyle = colours.ink2;
  ctx.beginPath();
  ctx.moveTo(x - 4 * ratio, low);
  ctx.lineTo(x + 4 * ratio, low);
  ctx.lineTo(x, low - 7 * ratio);
  ctx.fill();
  ctx.font = `12px ${colours.font}`;
  const width = ctx.measureText(mark.word).width * ratio;
  const right = x + 8 * ratio + width < bbox.left + bbox.width;
  const from = x + (right ? 8 : -8) * ratio;
  haloed(plot, mark.word, from, low - 8 * ratio, right ? "left" : "right", colours.ink2, colours);
}

/** Diagonal lines on the colour of the panel, with the word in the middle. */
export function hatch(plot: uPlot, area: Hatched, at: Projection, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const from = Math.max(bbox.left, at.x(area.from));
  const to = Math.min(bbox.left + bbox.width, at.x(area.to));
  if (to - from < ratio) return;
  const { top, height } = bbox;
  ctx.save();
  ctx.beginPath();
  ctx.rect(from, top, to - from, height);
  ctx.clip();
  ctx.fillStyle = colours.panel;
  ctx.fillRect(from, top, to - from, height);
  ctx.strokeStyle = colours.line;
  ctx.lineWidth = 1.5 * ratio;
  ctx.setLineDash([]);
  ctx.beginPath();
  // On a grid of the plot, so that neighbouring areas continue each other.
  const step = 8 * ratio;
  for (let x = Math.floor((from - height) / step) * step; x < to; x += step) {
    ctx.moveTo(x, top + height);
    ctx.lineTo(x + height, top);
  }
  ctx.stroke();
  ctx.strokeStyle = colours.edge;
  ctx.lineWidth = ratio;
  ctx.strokeRect(from, top - ratio, to - from + 2 * ratio, height + 2 * ratio);
  ctx.restore();
  if (area.word) middleWords(plot, area.word, (from + to) / 2, to - from, colours);
}

/** Words in the middle of an area, upright where it is narrow, left out where they do not fit. */
function middleWords(plot: uPlot, word: string, x: number, width: number, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const middle = bbox.top + bbox.height / 2;
  const ground = { ...colours, well: colours.panel };
  ctx.save();
  ctx.font = `${12 * ratio}px ${colours.font}`;
  const long = ctx.measureText(word).width;
  if (long < width - 4 * ratio) haloed(plot, word, x, middle + 4 * ratio, "center", colours.ink2, ground);
  else if (width > 16 * ratio && long < bbox.height - 4 * ratio) {
    ctx.translate(x + 4 * ratio, middle);
    ctx.rotate(-Math.PI / 2);
    haloed(plot, word, 0, 0, "center", colours.ink2, ground);
  }
  ctx.restore();
}

/** Words near a point, and a line to it. */
export function callout(plot: uPlot, one: Callout, at: Projection, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const x = at.x(one.t);
  const y = at.y(one.v);
  ctx.font = `600 ${12 * ratio}px ${colours.font}`;
  const width = ctx.measureText(one.word).width;
  const right = one.dx >= 0;
  const low = bbox.left + 4 * ratio + (right ? 0 : width);
  const high = bbox.left + bbox.width - 4 * ratio - (right ? width : 0);
  const from = Math.min(high, Math.max(low, x + one.dx * ratio));
  const level = Math.min(
    bbox.top + bbox.height - 6 * ratio,
    Math.max(bbox.top + 14 * ratio, y + one.dy * ratio),
  );
  if (one.dy !== 0) {
    ctx.strokeStyle = colours.ink2;
    ctx.lineWidth = ratio;
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.moveTo(x, y - Math.sign(y - level) * 4 * ratio);
    ctx.lineTo(x, level - 4 * ratio);
    ctx.lineTo(from - (right ? 4 : -4) * ratio, level - 4 * ratio);
    ctx.stroke();
  }
  haloed(plot, one.word, from, level, right ? "left" : "right", colours.ink, colours, 600);
}

/** An open dot where a curve ends because nothing reliable follows. */
export function openEnd(plot: uPlot, curve: PlotCurve, at: Projection, colours: Palette): void {
  const { ctx } = plot;
  const ratio = dpr();
  const { t, v } = curve.samples(at.min);
  let last = v.length - 1;
  while (last >= 0 && Number.isNaN(v[last] ?? Number.NaN)) last--;
  if (last < 0) return;
  ctx.beginPath();
  ctx.arc(at.x(t[last] ?? 0), at.y(v[last] ?? 0), 3.5 * ratio, 0, 2 * Math.PI);
  ctx.fillStyle = colours.well;
  ctx.strokeStyle = colourOf(curve.colour, colours);
  ctx.lineWidth = 1.6 * ratio;
  ctx.setLineDash([]);
  ctx.fill();
  ctx.stroke();
}

/** The trigger level: dotted, with a head at the left; in the intent colour while waiting, grey once fired. */
export function levelMark(plot: uPlot, level: TriggerLevel, at: Projection, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const y = Math.round(at.y(level.value)) + 0.5;
  const size = 6 * ratio;
  ctx.strokeStyle = level.waiting ? colours.intent : colours.ink3;
  ctx.fillStyle = ctx.strokeStyle;
  ctx.lineWidth = ratio;
  ctx.setLineDash([2 * ratio, 3 * ratio]);
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.beginPath();
  ctx.moveTo(bbox.left, y - size);
  ctx.lineTo(bbox.left + 1.5 * size, y);
  ctx.lineTo(bbox.left, y + size);
  ctx.fill();
}

/** Text above the band and every curve, with a halo for contrast. */
export function bandLabel(plot: uPlot, band: Band, at: Projection, colours: Palette, beside = false): void {
  const { left, width } = plot.bbox;
  if (beside) {
    const middle = at.y((band.low + band.high) / 2) + 4 * dpr();
    haloed(plot, band.label, left + width + 7 * dpr(), middle, "left", colours.limit, {
      ...colours,
      well: colours.panel,
    });
    return;
  }
  haloed(
    plot,
    band.label,
    left + width - 8 * dpr(),
    at.y(band.high) - 5 * dpr(),
    "right",
    colours.limit,
    colours,
  );
}

/** A word in the lower corner, where no curve is. */
export function cornerWord(plot: uPlot, word: string, colours: Palette): void {
  const { left, top, height } = plot.bbox;
  haloed(plot, word, left + 8 * dpr(), top + height - 8 * dpr(), "left", colours.ink2, colours);
}

/** The title of a lane, in its corner. */
export function laneTitle(plot: uPlot, title: string, colours: Palette): void {
  const { left, top } = plot.bbox;
  haloed(plot, title, left + 8 * dpr(), top + 16 * dpr(), "left", colours.ink, colours, 600);
}

function haloed(
  plot: uPlot,
  text: string,
  x: number,
  y: number,
  align: CanvasTextAlign,
  colour: string,
  colours: Palette,
  weight = 400,
): void {
  const { ctx } = plot;
  const ratio = dpr();
  ctx.font = `${weight} ${12 * ratio}px ${colours.font}`;
  ctx.textAlign = align;
  ctx.textBaseline = "alphabetic";
  ctx.strokeStyle = colours.well;
  ctx.lineJoin = "round";
  ctx.lineWidth = 5 * ratio;
  ctx.strokeText(text, x, y);
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y);
}

/** Letters at the curves, each at a different time, alternating above and below. */
export function tagAtCurve(
  plot: uPlot,
  curve: PlotCurve,
  place: number,
  at: Projection,
  colours: Palette,
): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const one = curve.samples(at.min);
  const index = nearestSample(one, curve.tagAt?.x ?? at.min + (at.max - at.min) * (0.26 + 0.085 * place));
  const value = one.v[index] ?? Number.NaN;
  if (index < 0 || Number.isNaN(value)) return;
  const side = (curve.tagAt?.above ?? place % 2 === 0) ? -1 : 1;
  const high = bbox.top + (TAG_PX / 2 + 2) * ratio;
  const low = bbox.top + bbox.height - (TAG_PX / 2 + 2) * ratio;
  const y = Math.min(low, Math.max(high, at.y(value) + side * 18 * ratio));
  boxed(ctx, curve.tag ?? "", at.x(one.t[index] ?? 0), y, colourOf(curve.colour, colours), colours);
}

function boxed(
  ctx: CanvasRenderingContext2D,
  letter: string,
  x: number,
  y: number,
  colour: string,
  colours: Palette,
): void {
  const ratio = dpr();
  const half = (TAG_PX / 2) * ratio;
  ctx.fillStyle = colours.well;
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1.5 * ratio;
  ctx.beginPath();
  ctx.roundRect(x - half, y - half, 2 * half, 2 * half, 2 * ratio);
  ctx.fill();
  ctx.stroke();
  ctx.fillStyle = colours.ink;
  ctx.font = `600 ${12 * ratio}px ${colours.font}`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillText(letter, x, y + 0.5 * ratio);
}

export interface CurveEnd {
  name: string;
  letter: string | null;
  y: number;
  colour: string;
  alpha: number;
}

/** Names right of the plot at the ends of their curves, without overlap with each other or with a curve. */
export function endNames(plot: uPlot, ends: CurveEnd[], gutter: number, colours: Palette): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  const step = (ends.some(one => one.letter) ? TAG_PX + 4 : NAME_PX) * ratio;
  const most = Math.max(1, Math.floor(bbox.height / step));
  ends.sort((a, b) => a.y - b.y);
  const shown = ends.length > most ? ends.filter((_, i) => i % Math.ceil(ends.length / most) === 0) : ends;
  const tops = shown.map(one => one.y);
  const low = bbox.top + step / 2;
  for (let i = 0; i < tops.length; i++) {
    tops[i] = Math.max(tops[i] ?? low, i === 0 ? low : (tops[i - 1] ?? low) + step);
  }
  for (let i = tops.length - 1; i >= 0; i--) {
    const below = i === tops.length - 1 ? bbox.top + bbox.height : (tops[i + 1] ?? 0) - step;
    tops[i] = Math.min(tops[i] ?? low, below);
  }
  ctx.save();
  shown.forEach((one, i) => {
    const y = tops[i] ?? low;
    const left = bbox.left + bbox.width;
    ctx.globalAlpha = one.alpha;
    ctx.strokeStyle = one.colour;
    ctx.lineWidth = ratio;
    ctx.beginPath();
    ctx.moveTo(left + ratio, one.y);
    ctx.lineTo(left + 7 * ratio, y);
    ctx.stroke();
    let x = left + NAME_GAP_PX * ratio;
    if (one.letter) {
      boxed(ctx, one.letter, x + (TAG_PX / 2) * ratio, y, one.colour, colours);
      x += (TAG_PX + 6) * ratio;
    }
    ctx.font = `${12 * ratio}px ${colours.font}`;
    ctx.textAlign = "left";
    ctx.textBaseline = "middle";
    ctx.fillStyle = one.letter ? colours.ink2 : one.colour;
    const room = gutter * ratio - (one.letter ? (TAG_PX + 6) * ratio : 0);
    ctx.fillText(fitting(ctx, one.name, room), x, y);
  });
  ctx.restore();
}

/** Marks above the plot, with a word where there is space. */
export function markHeads(
  plot: uPlot,
  marks: readonly MarkAt[],
  at: Projection,
  gutter: number,
  colours: Palette,
): void {
  const { ctx, bbox } = plot;
  const ratio = dpr();
  ctx.save();
  ctx.font = `${12 * ratio}px ${colours.font}`;
  ctx.textBaseline = "alphabetic";
  ctx.textAlign = "left";
  ctx.fillStyle = colours.ink2;
  let free = Number.NEGATIVE_INFINITY;
  for (const [place, mark] of marks.entries()) {
    const x = at.x(mark.t);
    const next = at.x(marks[place + 1]?.t ?? Number.POSITIVE_INFINITY) - 6 * ratio;
    ctx.beginPath();
    ctx.moveTo(x - 4 * ratio, bbox.top - 8 * ratio);
    ctx.lineTo(x + 4 * ratio, bbox.top - 8 * ratio);
    ctx.lineTo(x, bbox.top - ratio);
    ctx.fill();
    const width = ctx.measureText(mark.word).width;
    const right = bbox.left + bbox.width + gutter * ratio;
    const after = x + 7 * ratio;
    // The word goes left of the mark if it does not fit at the right, and is left out if another word is there.
    const left = after + width <= right ? after : x - 7 * ratio - width;
    const fits = left >= free && (left < x || left + width <= next);
    if (fits) ctx.fillText(mark.word, left, bbox.top - 5 * ratio);
    free = Math.max(x + 6 * ratio, fits ? left + width + 6 * ratio : free);
  }
  ctx.restore();
}

export function cursorHead(plot: uPlot, x: number, letter: string, colours: Palette): void {
  const ratio = dpr();
  boxed(plot.ctx, letter, x, plot.bbox.top - 10 * ratio, colours.ink2, colours);
}

/** Width for names beside a plot, pixels. */
export function widest(names: readonly string[], most: number, font: string): number {
  const canvas = document.createElement("canvas");
  const ctx = canvas.getContext("2d");
  if (!ctx) return most;
  // Text has the page's font metrics only in a canvas inside the page.
  document.body.append(canvas);
  ctx.font = `12px ${font}`;
  const width = Math.ceil(Math.max(0, ...names.map(one => ctx.measureText(one).width)));
  canvas.remove();
  return Math.min(most, width);
}

/** A name, truncated to fit the picture. */
function fitting(ctx: CanvasRenderingContext2D, name: string, width: number): string {
  if (ctx.measureText(name).width <= width + 2) return name;
  let cut = name;
  while (cut.length > 1 && ctx.measureText(`${cut}…`).width > width) cut = cut.slice(0, -1);
  return `${cut}…`;
}
