/** The plot component: axes, series and cursors by uPlot, drawn in the page's shared animation frame and colours. */
import "./locale";
import uPlot from "uplot";
import "./uplot.css";
import type { Band, Callout, CurveEnd, Hatched, MarkAt, TriggerLevel } from "./annotate";
import * as pen from "./annotate";
import { CurveLayer, type Pen } from "./curve-layer";
import { everyFrame } from "./frames";
import { laneTicksOf } from "./lane";
import { type Palette, palette } from "./palette";
import { Playhead } from "./playhead";
import {
  type CurveDrawn,
  endOf,
  isPlain,
  linePath,
  type PlotCurve,
  type Projection,
  pointsPath,
  projection,
} from "./series";
import type { Still, TimeSpan } from "./span";
import { extent, nearestSample } from "./trace";

export interface Picture {
  curves: readonly PlotCurve[];
  bands?: readonly Band[];
  marks?: () => readonly MarkAt[];
  /** Title in the corner. */
  title?: string;
  /** Word in the lower corner. */
  corner?: string;
  /** Times named at the foot. */
  feet?: readonly MarkAt[];
  hatched?: readonly Hatched[];
  callouts?: readonly Callout[];
  level?: TriggerLevel;
  /** Time limits of all data; a plot with a `span` shows the span instead. */
  from?: number;
  to?: number;
  /** Range of y for the extent drawn, which is null without data. */
  range: (
    drawn: readonly [number, number] | null,
    before: readonly [number, number] | null,
  ) => readonly [number, number];
  /** All names beside any plot of a stack, so that they have the same width; without it none are shown. */
  names?: readonly string[];
}

export interface PlotOptions {
  x: (value: number, step: number) => string;
  y: (value: number, step: number) => string;
  /** The time span it shows and follows; without one it shows everything, and a drag zooms. */
  span?: TimeSpan;
  /** Maximum number of draws per second. */
  hz?: number;
  /** Whether the heads of marks and cursors are above it, and the x axis below it. */
  first?: boolean;
  last?: boolean;
  cursors?: readonly [string, string];
  /** Vertical lines at the ticks of x. */
  ruled?: boolean;
  yWidth?: number;
  /** Ticks of x within these limits, where they are not at multiples of a step. */
  xTicks?: (from: number, to: number) => number[];
  yTicks?: (from: number, to: number) => number[];
  /** Width at the right for the names of bands; without it they are inside. */
  beside?: number;
  /** Text for the values under the pointer. */
  read?: (x: number, values: readonly { name: string; value: number }[]) => string;
  readout?: HTMLElement | null;
  /** Plots of a group share their cursor and their zoom. */
  group?: string;
  /** Further inputs that require a redraw of a paused picture. */
  state?: () => string;
  /** Draws on top of everything. */
  over?: (plot: uPlot, at: Projection, colours: Palette) => void;
}

/** Maximum resolution of a screen. */
const FPS = 60;
const LOOK_HZ = 10;
const EDGE_PX = 14;
const NAMES_PX = 104;
const LETTER_PX = 24;
const HEAD_PX = 20;
const DIM = 0.35;
const X_STEPS = [
  0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120,
  300, 600, 1200, 3600,
];
/** Placeholder data for uPlot: the path builders read the curves themselves. */
const FLAT = [0, 0];

export class Plot {
  #box: HTMLElement;
  #options: PlotOptions;
  #picture: Picture = { curves: [], range: () => [0, 1] };
  #curves: readonly PlotCurve[] = [];
  #plot: uPlot | null = null;
  #made = "";
  #view: [number, number] | null = null;
  #range: readonly [number, number] | null = null;
  #ticks: number[] = [];
  #still: Still | null = null;
  #shown: Still | null = null;
  #drawn = "";
  #version = 0;
  #ends: (CurveEnd | null)[] = [];
  #layer = new CurveLayer();
  /** Whether the measured curves are in the layer. */
  #layered = false;
  #drawnAt = 0;
  /** Width for names beside it, measured when it is built. */
  #gutter = 0;
  #head = new Playhead();
  #moment: number | null = null;
  #forget: () => void;
  #resize: ResizeObserver;

  constructor(box: HTMLElement, options: PlotOptions) {
    this.#box = box;
    this.#options = options;
    this.#forget = everyFrame(box, options.span ? (options.hz ?? FPS) : LOOK_HZ, now => this.#frame(now));
    this.#resize = new ResizeObserver(() => this.#fit());
    this.#resize.observe(box);
  }

  show(picture: Picture): void {
    this.#picture = picture;
    // Commands are drawn over measured curves, so that both are visible where they coincide.
    this.#curves = [...picture.curves].sort((a, b) => Number(a.dashed === true) - Number(b.dashed === true));
    this.#version++;
    this.#drawn = "";
    this.#zoom();
  }

  /** Show this part of the time; null shows all of it. */
  look(view: [number, number] | null): void {
    this.#view = view;
    this.#zoom();
  }

  /** Draw a line at the present moment of a recording; null removes it. */
  head(moment: number | null): void {
    this.#moment = moment;
    this.#place();
  }

  destroy(): void {
    this.#forget();
    this.#resize.disconnect();
    this.#plot?.destroy();
    if (this.#options.readout) this.#options.readout.textContent = "";
  }

  /** The canvas as drawn now, for export. */
  get canvas(): HTMLCanvasElement | null {
    return this.#plot?.ctx.canvas ?? null;
  }

  /** Time at a pixel of the window; null outside the face. */
  timeAt(clientX: number): number | null {
    const face = this.#plot?.over.getBoundingClientRect();
    const shown = this.#shown;
    if (!face || !shown || face.width === 0) return null;
    const part = (clientX - face.left) / face.width;
    return part < 0 || part > 1 ? null : shown.from + part * (shown.to - shown.from);
  }

  /** Seconds per pixel of the window. */
  get secondsPerPixel(): number {
    const width = this.#plot?.over.clientWidth ?? 0;
    return this.#shown && width > 0 ? (this.#shown.to - this.#shown.from) / width : 0;
  }

  #fit(): void {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (this.#plot && width > 0 && height > 0) this.#plot.setSize({ width, height });
    this.#drawn = "";
  }

  /** The plot is rebuilt when this changes. */
  #make(): string {
    const { names } = this.#picture;
    const looks = this.#curves.map(one => [one.colour, one.dashed, one.bold, one.faint, one.filled].join());
    return [document.documentElement.dataset.theme, names?.join(), ...looks].join("|");
  }

  #frame(now: number): void {
    const made = this.#make();
    if (!this.#plot || made !== this.#made) this.#build(made);
    const span = this.#options.span;
    if (!span || !this.#plot) return;
    const still = span.still.peek();
    const shown = still ?? inWholePixels(span.shown(), this.#plot.bbox.width);
    if (!shown) return;
    const moment = span.head.peek();
    this.#head.place(
      this.#plot.over,
      moment === null ? null : (moment - shown.from) / (shown.to - shown.from),
    );
    if (still && !this.#changed(span, still)) return;
    // A long span moves by less than a pixel per frame.
    if (!still && shown.from === this.#shown?.from && now - this.#drawnAt < 1 / LOOK_HZ) return;
    this.#drawnAt = now;
    const turned = this.#still !== still;
    this.#still = still;
    if (turned && still) this.#range = null;
    this.#shown = span.drawn = shown;
    const [min, max] = this.#high(shown.from, shown.to);
    // Both lead to one drawing at the end of this turn. Setting the data makes uPlot request paths again.
    this.#plot.setData(this.#data(), false);
    this.#plot.setScale("x", { min: shown.from - shown.zero, max: shown.to - shown.zero });
    this.#plot.setScale("y", { min, max });
    if (turned) this.#plot.redraw(false, true);
  }

  /** A paused picture is drawn again only when one of these changes. */
  #changed(span: TimeSpan, still: Still): boolean {
    const { cursors, drag, lit } = span;
    const dragged = drag.peek();
    const now = [
      this.#version,
      still.from,
      still.to,
      ...cursors.peek(),
      dragged?.from,
      dragged?.to,
      lit.peek(),
      this.#picture.marks?.().length,
      this.#made,
      this.#options.state?.(),
    ].join(" ");
    if (now === this.#drawn) return false;
    this.#drawn = now;
    return true;
  }

  #data(): uPlot.AlignedData {
    const { from = 0, to = 1 } = this.#picture;
    return [[from, to], ...this.#curves.map(() => FLAT)];
  }

  #zoom(): void {
    const { from = 0, to = 1 } = this.#picture;
    // Added or removed curves appear when the plot is rebuilt, in the next frame.
    if (!this.#plot || this.#options.span || this.#made !== this.#make()) return;
    const [min, max] = this.#view ?? [from, to];
    this.#plot.setData(this.#data(), false);
    this.#plot.setScale("x", { min, max });
  }

  #place(): void {
    const { min, max } = this.#plot?.scales.x ?? {};
    if (!this.#plot || this.#options.span || min === undefined || max === undefined) return;
    this.#head.place(this.#plot.over, this.#moment === null ? null : (this.#moment - min) / (max - min));
  }

  #high(from: number, to: number): readonly [number, number] {
    const drawn = extent(
      this.#curves.map(one => one.samples(from)),
      from,
      to,
    );
    this.#range = this.#picture.range(drawn, this.#range);
    const [min, max] = this.#range;
    const height = (this.#plot?.bbox.height ?? 200) / (devicePixelRatio || 1);
    this.#ticks = this.#options.yTicks?.(min, max) ?? laneTicksOf(min, max, Math.max(3, height / 34));
    return this.#range;
  }

  #build(made: string): void {
    this.#plot?.destroy();
    this.#made = made;
    this.#drawn = "";
    this.#range = null;
    const colours = palette();
    const font = `12px ${colours.font}`;
    const { span, first, last = true, group, x, y, ruled, yWidth = 56, xTicks, beside } = this.#options;
    const gutter = this.#measured(colours);
    this.#gutter = gutter;
    this.#plot = new uPlot(
      {
        width: Math.max(50, this.#box.clientWidth),
        height: Math.max(50, this.#box.clientHeight),
        padding: [
          first || (!span && this.#picture.marks) ? HEAD_PX : span ? 6 : 10,
          gutter > 0 ? Math.max(18, gutter + pen.NAME_GAP_PX + EDGE_PX) : (beside ?? 30),
          last ? 0 : 6,
          0,
        ],
        legend: { show: false },
        cursor: span
          ? { show: false }
          : {
              y: false,
              points: { show: false },
              drag: { x: true, y: false, setScale: true },
              ...(group === undefined ? {} : { sync: { key: group } }),
            },
        scales: {
          x: { time: false, auto: false, min: this.#picture.from ?? 0, max: this.#picture.to ?? 1 },
          y: span
            ? { auto: false }
            : {
                range: plot => {
                  const { from = 0, to = 1 } = this.#picture;
                  const [low, high] = this.#high(plot.scales.x?.min ?? from, plot.scales.x?.max ?? to);
                  return [low, high];
                },
              },
        },
        axes: [
          {
            show: last,
            stroke: colours.ink2,
            font,
            size: 28,
            gap: 6,
            space: 64,
            incrs: X_STEPS,
            ...(xTicks ? { splits: (_plot, _axis, from, to) => xTicks(from, to) } : {}),
            grid: { show: ruled === true, stroke: colours.line, width: 1 },
            ticks: { stroke: colours.edge, width: 1, size: 4 },
            values: (_plot, splits, _axis, _space, step) => splits.map(v => x(v, step)),
          },
          {
            stroke: colours.ink2,
            font,
            size: yWidth,
            gap: 6,
            splits: () => this.#ticks,
            grid: { show: false },
            ticks: { show: false },
            values: (_plot, splits) => {
              const step = (splits[1] ?? 1) - (splits[0] ?? 0);
              return splits.map(v => y(v, step));
            },
          },
        ],
        series: [{}, ...this.#curves.map((curve, place) => this.#series(curve, place, colours))],
        hooks: {
          drawClear: [plot => this.#under(plot, colours)],
          drawAxes: [plot => this.#drawLayer(plot, colours)],
          draw: [plot => this.#over(plot, colours), () => this.#place()],
          setCursor: [plot => this.#say(plot)],
        },
      },
      this.#data(),
      this.#box,
    );
    this.#zoom();
  }

  #measured(colours: Palette): number {
    const { names } = this.#picture;
    if (!names) return 0;
    const letters = this.#curves.some(one => one.tag !== undefined) ? LETTER_PX : 0;
    return pen.widest(names, NAMES_PX, colours.font) + letters;
  }

  #series(curve: PlotCurve, place: number, colours: Palette): uPlot.Series {
    const ratio = devicePixelRatio || 1;
    const { colour, width } = this.#penOf(curve, colours);
    const spanned = this.#options.span !== undefined;
    return {
      stroke: colour,
      width,
      alpha: 1,
      ...(curve.dashed ? { dash: [7 * ratio, 5 * ratio] } : {}),
      ...(curve.filled ? { fill: tinted(colour) } : {}),
      pxAlign: 0,
      auto: false,
      paths: plot => {
        // A drawing may be due from before the picture changed.
        const shown = this.#curves[place];
        if (!shown) return null;
        const { alpha, width } = this.#penOf(shown, colours);
        const series = plot.series[place + 1];
        if (series) Object.assign(series, { alpha, width });
        const at = projection(plot, this.#zero);
        const end = (end: CurveDrawn["end"]) => {
          const { name = "", tag: letter = null } = shown;
          this.#ends[place] = end && { name, letter, y: end.y, colour, alpha };
        };
        if (this.#layered && !shown.dashed) {
          end(endOf(at, shown));
          return null;
        }
        const line = linePath(plot, at, shown);
        end(line.end);
        return { stroke: line.stroke, fill: line.fill, flags: 0 };
      },
      points: {
        show: !spanned && !curve.dashed && !curve.held && !curve.plain,
        width: 0,
        stroke: colour,
        fill: colour,
        paths: plot => {
          const shown = this.#curves[place];
          const fill = shown && pointsPath(plot, projection(plot, this.#zero), shown);
          return { stroke: null, fill: fill ?? new Path2D(), flags: 0 };
        },
      },
    };
  }

  #penOf(curve: PlotCurve, colours: Palette): Pen {
    const { span } = this.#options;
    const lit = span?.lit.peek() ?? null;
    const chosen = lit !== null && lit === curve.key;
    // A command in the colour of its measured curve is wider, so that its dashes are visible on top of it.
    const dashes = typeof curve.colour === "number" ? 3 : 1.6;
    const width = curve.dashed ? dashes : curve.bold ? 2.6 : span ? 1.8 : 1.5;
    return {
      colour: pen.colourOf(curve.colour, colours),
      alpha: (lit === null || chosen ? 1 : DIM) * (curve.faint ? 0.6 : 1),
      width: chosen ? 2.6 : width,
    };
  }

  /** While following, the measured curves are drawn in a layer, if all of them are plain. */
  #drawLayer(plot: uPlot, colours: Palette): void {
    const { span } = this.#options;
    const at = projection(plot, this.#zero);
    const measured = this.#curves.filter(one => !one.dashed);
    this.#layered = span?.still.peek() === null && measured.every(one => isPlain(plot, at, one));
    if (!span || !this.#layered) return;
    const ratio = devicePixelRatio || 1;
    const curves = measured.map(curve => {
      const { width, ...rest } = this.#penOf(curve, colours);
      return { curve, pen: { ...rest, width: width * ratio } };
    });
    const { width, height } = plot.bbox;
    const seconds = span.seconds.peek();
    const look = [this.#made, this.#version, span.lit.peek(), width, height, seconds, ...(this.#range ?? [])];
    this.#layer.draw(plot, at, curves, look.join());
  }

  #of(place: number): PlotCurve {
    return this.#curves[place] as PlotCurve;
  }

  get #zero(): number {
    return this.#options.span ? (this.#shown?.zero ?? 0) : 0;
  }

  #under(plot: uPlot, colours: Palette): void {
    const at = projection(plot, this.#zero);
    this.#ends = [];
    pen.ground(plot, this.#ticks, at, colours);
    pen.clip(plot);
    for (const band of this.#picture.bands ?? []) pen.drawBand(plot, band, at, colours);
    for (const area of this.#picture.hatched ?? []) pen.hatch(plot, area, at, colours);
    plot.ctx.restore();
  }

  #over(plot: uPlot, colours: Palette): void {
    const at = projection(plot, this.#zero);
    const { ctx, bbox } = plot;
    const { span, first, cursors, beside } = this.#options;
    const { names, bands = [], title, corner, level, feet = [], callouts = [] } = this.#picture;
    const marks = (this.#picture.marks?.() ?? []).filter(one => one.t >= at.min && one.t <= at.max);
    pen.clip(plot);
    ctx.setLineDash([]);
    for (const one of marks) pen.upright(plot, at.x(one.t), colours.ink3);
    if (level) pen.levelMark(plot, level, at, colours);
    const drag = span?.drag.peek();
    const placed = span?.cursors.peek() ?? [];
    const [a, b] = placed;
    const tint =
      drag ?? (cursors && typeof a === "number" && typeof b === "number" ? { from: a, to: b } : null);
    if (tint) {
      ctx.fillStyle = colours.ink;
      ctx.globalAlpha = drag ? 0.12 : 0.035;
      ctx.fillRect(at.x(tint.from), bbox.top, at.x(tint.to) - at.x(tint.from), bbox.height);
      ctx.globalAlpha = 1;
    }
    for (const one of placed) if (one !== null) pen.upright(plot, at.x(one), colours.ink2);
    for (const mark of feet) pen.footMark(plot, mark, at, colours);
    if (beside === undefined) for (const band of bands) pen.bandLabel(plot, band, at, colours);
    for (const curve of this.#curves) if (curve.open) pen.openEnd(plot, curve, at, colours);
    for (const one of callouts) pen.callout(plot, one, at, colours);
    if (!names) {
      this.#curves
        .filter(one => one.tag !== undefined)
        .forEach((curve, place) => {
          pen.tagAtCurve(plot, curve, place, at, colours);
        });
    }
    if (title) pen.laneTitle(plot, title, colours);
    if (corner) pen.cornerWord(plot, corner, colours);
    ctx.restore();
    ctx.save();
    if (beside !== undefined) for (const band of bands) pen.bandLabel(plot, band, at, colours, true);
    ctx.setLineDash([]);
    if (names) {
      const crowd = this.#curves.length > 8;
      const ends = this.#ends.filter((one, i) => one && one.name !== "" && !(crowd && this.#of(i).dashed));
      pen.endNames(plot, ends as CurveEnd[], this.#gutter, colours);
    }
    if (first || !span) pen.markHeads(plot, marks, at, names ? this.#gutter : 0, colours);
    if (first && cursors) {
      placed.forEach((one, i) => {
        if (one !== null && one >= at.min && one <= at.max) {
          pen.cursorHead(plot, at.x(one), cursors[i] ?? "", colours);
        }
      });
    }
    this.#options.over?.(plot, at, colours);
    ctx.restore();
  }

  #say(plot: uPlot): void {
    const { readout, read } = this.#options;
    if (!readout || !read) return;
    const left = plot.cursor.left ?? -1;
    if (left < 0) {
      readout.textContent = "";
      return;
    }
    const at = plot.posToVal(left, "x");
    const values = this.#picture.curves.flatMap(curve => {
      if (curve.name === undefined) return [];
      const one = curve.samples(Number.NEGATIVE_INFINITY);
      const index = nearestSample(one, at);
      const value = one.v[index] ?? Number.NaN;
      return index < 0 || Number.isNaN(value) ? [] : [{ name: curve.name, value }];
    });
    readout.textContent = read(at, values);
  }
}

/** The span moved by less than a pixel, so that a pixel of the plot is always the same time. */
function inWholePixels(shown: Still | null, width: number): Still | null {
  if (!shown) return null;
  const pixel = (shown.to - shown.from) / width;
  const by = Math.floor(shown.to / pixel) * pixel - shown.to;
  return { from: shown.from + by, to: shown.to + by, zero: shown.zero + by };
}

/** A tint of a token's colour for the area below a curve. */
function tinted(colour: string): string {
  return `color-mix(in srgb, ${colour} 10%, transparent)`;
}

/** A range of at least a minimum height around the curves, so that noise does not fill the plot; bands stay inside. */
export function roomy(least: number, bands: readonly Band[] = []): Picture["range"] {
  return drawn => {
    let [low, high] = drawn ?? [0, 0];
    for (const band of bands) {
      low = Math.min(low, band.low);
      high = Math.max(high, band.high);
    }
    const room = Math.max(0, least - (high - low)) / 2 + 0.09 * Math.max(least, high - low);
    return [low - room, high + room];
  };
}
