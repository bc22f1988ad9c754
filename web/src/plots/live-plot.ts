/** The picture of one lane: axes by uPlot, curves out of the rings, names at their ends, marks, cursors. */
import uPlot from "uplot";
import type { TelemetryStore } from "../telemetry/store";
import { clip, colourOf, curveOf, ground, projection, ruled, upright } from "./draw";
import { everyFrame } from "./frames";
import { calmRange, keyOf, type Lane, laneTicksOf } from "./lane";
import { type Palette, palette } from "./palette";
import { Playhead } from "./playhead";
import type { Still, TimeSpan } from "./span";
import { extent, type Samples } from "./trace";

export interface PlotText {
  now: string;
  /** Seconds from the zero of the axis. */
  before: (s: number, step: number) => string;
  value: (v: number, step: number) => string;
  cursors: readonly [string, string];
}

export interface MarkAt {
  /** The server's clock. */
  t: number;
  word: string;
}

export interface LivePlotOptions {
  text: PlotText;
  marks: () => readonly MarkAt[];
  /** Whether it has words at the top and the bottom of all lanes: the first and the last. */
  first: boolean;
  last: boolean;
}

/** What a screen shows, at most: a rate of 60 Hz is halved by a slower one only where that is told to be enough. */
const FPS = 60;
/** From the plot to the names beside it, and from them to the edge of the picture. */
const NAME_GAP_PX = 9;
const EDGE_PX = 14;
const NAME_PX = 14;
const NAMES_PX = 104;
const MARKS_PX = 16;
const DIM = 0.35;
const X_STEPS = [
  0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600,
];

interface End {
  name: string;
  y: number;
  colour: string;
  alpha: number;
}

export class LivePlot {
  #box: HTMLElement;
  #store: TelemetryStore;
  #span: TimeSpan;
  #options: LivePlotOptions;
  #lane: Lane = { unit: "", decimals: 0, curves: [] };
  #plot: uPlot | null = null;
  #theme = "";
  #gutter = 0;
  #range: readonly [number, number] | null = null;
  #of: Still | null = null;
  #shown: Still | null = null;
  #ticks: number[] = [];
  #drawn = "";
  #version = 0;
  #head = new Playhead();
  #end: () => void;
  #resize: ResizeObserver;

  constructor(box: HTMLElement, store: TelemetryStore, span: TimeSpan, options: LivePlotOptions) {
    this.#box = box;
    this.#store = store;
    this.#span = span;
    this.#options = options;
    this.#end = everyFrame(box, FPS, () => this.#draw());
    this.#resize = new ResizeObserver(() => this.#fit());
    this.#resize.observe(box);
  }

  /** `names`: all that stand beside any lane, so that lanes under one another are of one width. */
  show(lane: Lane, names: readonly string[]): void {
    if (lane.unit !== this.#lane.unit) this.#range = null;
    this.#lane = lane;
    this.#version++;
    const gutter = Math.min(NAMES_PX, widest(names));
    if (gutter !== this.#gutter) this.#theme = "";
    this.#gutter = gutter;
  }

  destroy(): void {
    this.#end();
    this.#resize.disconnect();
    this.#plot?.destroy();
  }

  /** What is seen now, to be put into a file. */
  get canvas(): HTMLCanvasElement | null {
    return this.#plot?.ctx.canvas ?? null;
  }

  /** The server's time under a pixel of the window; null outside the face. */
  timeAt(clientX: number): number | null {
    const face = this.#plot?.over.getBoundingClientRect();
    const shown = this.#shown;
    if (!face || !shown || face.width === 0) return null;
    const part = (clientX - face.left) / face.width;
    return part < 0 || part > 1 ? null : shown.from + part * (shown.to - shown.from);
  }

  /** How much of the picture's time a pixel of the window is. */
  get secondsPerPixel(): number {
    const width = this.#plot?.over.clientWidth ?? 0;
    return this.#shown && width > 0 ? (this.#shown.to - this.#shown.from) / width : 0;
  }

  #fit(): void {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (this.#plot && width > 0 && height > 0) this.#plot.setSize({ width, height });
    this.#drawn = "";
  }

  #draw(): void {
    const theme = document.documentElement.dataset.theme ?? "";
    if (this.#plot === null || theme !== this.#theme) this.#make(theme);
    const shown = this.#span.shown();
    if (!shown || !this.#plot) return;
    const still = this.#span.still.peek();
    const moment = this.#span.head.peek();
    const across = moment === null ? null : (moment - shown.from) / (shown.to - shown.from);
    this.#head.place(this.#plot.over, across);
    if (still && !this.#changed(still)) return;
    const turned = this.#of !== still;
    this.#of = still;
    if (turned && still) this.#range = null;
    this.#shown = this.#span.drawn = shown;
    const drawn = extent(
      this.#lane.curves.map(one => this.#samples(one)),
      shown.from,
      shown.to,
    );
    this.#range = calmRange(drawn, this.#lane.unit, this.#range);
    const [min, max] = this.#range;
    this.#ticks = laneTicksOf(min, max, Math.max(2, this.#plot.bbox.height / (devicePixelRatio || 1) / 34));
    // Both lead to one drawing, at the end of this turn, even where they stay as they were.
    this.#plot.setScale("x", { min: shown.from - shown.zero, max: shown.to - shown.zero });
    this.#plot.setScale("y", { min, max });
    if (turned) this.#plot.redraw(false, true);
  }

  /** A picture that stands still is drawn again only when something in it is another. */
  #changed(still: Still): boolean {
    const { cursors, drag, lit } = this.#span;
    const dragged = drag.peek();
    const now = [
      this.#version,
      still.from,
      still.to,
      ...cursors.peek(),
      dragged?.from,
      dragged?.to,
      lit.peek(),
      this.#options.marks().length,
      this.#theme,
    ].join(" ");
    if (now === this.#drawn) return false;
    this.#drawn = now;
    return true;
  }

  #samples(curve: { uid: string; channel: string }): Samples {
    const ring = this.#store.ring(curve.uid, curve.channel);
    return ring.since(this.#span.shown()?.from ?? Number.NEGATIVE_INFINITY);
  }

  #make(theme: string): void {
    this.#plot?.destroy();
    this.#theme = theme;
    this.#drawn = "";
    const colours = palette();
    const font = `12px ${colours.font}`;
    const { text, first, last } = this.#options;
    this.#plot = new uPlot(
      {
        width: Math.max(50, this.#box.clientWidth),
        height: Math.max(50, this.#box.clientHeight),
        padding: [
          first ? MARKS_PX + 4 : 6,
          Math.max(18, this.#gutter + NAME_GAP_PX + EDGE_PX),
          last ? 0 : 6,
          0,
        ],
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false, auto: false }, y: { auto: false } },
        axes: [
          {
            show: last,
            stroke: colours.ink2,
            font,
            size: 28,
            gap: 6,
            space: 64,
            incrs: X_STEPS,
            grid: { show: false },
            ticks: { stroke: colours.edge, width: 1, size: 4 },
            values: (_plot, splits, _axis, _space, step) =>
              splits.map(v =>
                Math.abs(v) < step * 1e-6 && !this.#span.still.peek() ? text.now : text.before(v, step),
              ),
          },
          {
            stroke: colours.ink2,
            font,
            size: 56,
            gap: 6,
            splits: () => this.#ticks,
            grid: { show: false },
            ticks: { show: false },
            values: (_plot, splits) => {
              const step = (splits[1] ?? 1) - (splits[0] ?? 0);
              return splits.map(v => text.value(v, step));
            },
          },
        ],
        series: [{}, { paths: () => null, points: { show: false } }],
        hooks: {
          drawClear: [plot => ground(plot, colours)],
          draw: [plot => this.#paint(plot, colours)],
        },
      },
      [
        [0, 1],
        [0, 0],
      ],
      this.#box,
    );
  }

  #paint(plot: uPlot, colours: Palette): void {
    const shown = this.#shown;
    if (!shown) return;
    const at = projection(plot, shown.zero);
    const ratio = devicePixelRatio || 1;
    clip(plot);
    ruled(plot, this.#ticks, at.y, colours);
    const ends: End[] = [];
    const lit = this.#span.lit.peek();
    for (const curve of this.#lane.curves) {
      const line = curveOf(plot, at, this.#samples(curve), { gaps: true });
      const colour = colourOf(curve.colour, colours);
      const chosen = lit === keyOf(curve);
      const alpha = lit === null || chosen ? 1 : DIM;
      plot.ctx.globalAlpha = alpha;
      plot.ctx.strokeStyle = colour;
      plot.ctx.lineJoin = "round";
      plot.ctx.lineWidth = (chosen ? 2.6 : curve.dashed ? 1.6 : 1.8) * ratio;
      plot.ctx.setLineDash(curve.dashed ? [7 * ratio, 5 * ratio] : []);
      plot.ctx.stroke(line.path);
      if (line.end && !(curve.dashed && this.#lane.curves.length > 8)) {
        ends.push({ name: curve.name, y: line.end.y, colour, alpha });
      }
    }
    plot.ctx.setLineDash([]);
    plot.ctx.globalAlpha = 1;
    for (const mark of this.#inSight(shown)) upright(plot, Math.round(at.x(mark.t)), colours.ink3);
    this.#cursors(plot, at.x, colours);
    plot.ctx.restore();
    this.#names(plot, ends, colours);
    if (this.#options.first) this.#heads(plot, at.x, shown, colours);
  }

  #inSight(shown: Still): MarkAt[] {
    return this.#options.marks().filter(one => one.t >= shown.from && one.t <= shown.to);
  }

  #cursors(plot: uPlot, x: (t: number) => number, colours: Palette): void {
    const { ctx, bbox } = plot;
    const drag = this.#span.drag.peek();
    if (drag) {
      ctx.fillStyle = colours.ink;
      ctx.globalAlpha = 0.12;
      ctx.fillRect(x(drag.from), bbox.top, x(drag.to) - x(drag.from), bbox.height);
      ctx.globalAlpha = 1;
    }
    for (const one of this.#span.cursors.peek()) {
      if (one !== null) upright(plot, Math.round(x(one)), colours.ink2);
    }
  }

  /** Names stand right of the plot at the end of their curves, never on one another and never on a curve. */
  #names(plot: uPlot, ends: End[], colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const step = NAME_PX * ratio;
    const most = Math.max(1, Math.floor(bbox.height / step));
    ends.sort((a, b) => a.y - b.y);
    const told = ends.length > most ? ends.filter((_, i) => i % Math.ceil(ends.length / most) === 0) : ends;
    const tops = told.map(one => one.y);
    const low = bbox.top + step / 2;
    for (let i = 0; i < tops.length; i++) {
      tops[i] = Math.max(tops[i] ?? low, i === 0 ? low : (tops[i - 1] ?? low) + step);
    }
    for (let i = tops.length - 1; i >= 0; i--) {
      const below = i === tops.length - 1 ? bbox.top + bbox.height : (tops[i + 1] ?? 0) - step;
      tops[i] = Math.min(tops[i] ?? low, below);
    }
    ctx.save();
    ctx.font = `${12 * ratio}px ${colours.font}`;
    ctx.textAlign = "left";
    ctx.textBaseline = "middle";
    told.forEach((one, i) => {
      const y = tops[i] ?? low;
      ctx.globalAlpha = one.alpha;
      ctx.strokeStyle = ctx.fillStyle = one.colour;
      ctx.lineWidth = ratio;
      const left = bbox.left + bbox.width;
      ctx.beginPath();
      ctx.moveTo(left + ratio, one.y);
      ctx.lineTo(left + 7 * ratio, y);
      ctx.stroke();
      ctx.fillText(fitting(ctx, one.name, this.#gutter * ratio), left + NAME_GAP_PX * ratio, y);
    });
    ctx.restore();
  }

  /** Above the first lane: the letters of the cursors, and marks with a word where there is room. */
  #heads(plot: uPlot, x: (t: number) => number, shown: Still, colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const base = bbox.top - 5 * ratio;
    ctx.save();
    ctx.font = `${12 * ratio}px ${colours.font}`;
    ctx.textBaseline = "alphabetic";
    ctx.textAlign = "left";
    const marks = this.#inSight(shown);
    let free = Number.NEGATIVE_INFINITY;
    for (const [place, mark] of marks.entries()) {
      const at = x(mark.t);
      const next = x(marks[place + 1]?.t ?? Number.POSITIVE_INFINITY) - 6 * ratio;
      ctx.fillStyle = colours.ink2;
      ctx.beginPath();
      ctx.moveTo(at - 4 * ratio, bbox.top - 8 * ratio);
      ctx.lineTo(at + 4 * ratio, bbox.top - 8 * ratio);
      ctx.lineTo(at, bbox.top - ratio);
      ctx.fill();
      const width = ctx.measureText(mark.word).width;
      const right = bbox.left + bbox.width + this.#gutter * ratio;
      const after = at + 7 * ratio;
      // Before the mark where it would leave the picture after it; nowhere if another stands there.
      const left = after + width <= right ? after : at - 7 * ratio - width;
      const fits = left >= free && (left < at || left + width <= next);
      if (fits) ctx.fillText(mark.word, left, base);
      free = Math.max(at + 6 * ratio, fits ? left + width + 6 * ratio : free);
    }
    ctx.font = `600 ${12 * ratio}px ${colours.font}`;
    ctx.textAlign = "center";
    this.#span.cursors.peek().forEach((one, i) => {
      if (one === null || one < shown.from || one > shown.to) return;
      const half = 8 * ratio;
      ctx.fillStyle = colours.well;
      ctx.strokeStyle = colours.ink2;
      ctx.lineWidth = ratio;
      ctx.beginPath();
      ctx.roundRect(x(one) - half, bbox.top - 17 * ratio, 2 * half, 16 * ratio, 2 * ratio);
      ctx.fill();
      ctx.stroke();
      ctx.fillStyle = colours.ink;
      ctx.fillText(this.#options.text.cursors[i] ?? "", x(one), base);
    });
    ctx.restore();
  }
}

function widest(names: readonly string[]): number {
  const ctx = document.createElement("canvas").getContext("2d");
  if (!ctx) return NAMES_PX;
  ctx.font = `12px ${palette().font}`;
  return Math.ceil(Math.max(0, ...names.map(one => ctx.measureText(one).width)));
}

/** A name, cut where it would leave the picture. */
function fitting(ctx: CanvasRenderingContext2D, name: string, width: number): string {
  if (ctx.measureText(name).width <= width + 2) return name;
  let cut = name;
  while (cut.length > 1 && ctx.measureText(`${cut}…`).width > width) cut = cut.slice(0, -1);
  return `${cut}…`;
}
