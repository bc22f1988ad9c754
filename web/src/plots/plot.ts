/** Owns one uPlot of angle and command over the last seconds; fed from rings, drawn only while seen. */
import uPlot from "uplot";
import type { TelemetryStore } from "../telemetry/store";
import { everyFrame } from "./frames";
import { palette } from "./palette";
import { type Cell, type Columns, calmRange, merge } from "./series";

export interface PlotText {
  angle: string;
  command: string;
  now: string;
  seconds: (before: number) => string;
  degrees: (value: number) => string;
}

const FPS = 20;
const LINE_PX = 16;
/** A line may bridge this many periods: one late answer is no gap, two are. */
const GAP_PERIODS = 3;

export class AnglePlotter {
  #box: HTMLElement;
  #store: TelemetryStore;
  #uid: string;
  #text: PlotText;
  #plot: uPlot | null = null;
  #theme = "";
  #range: [number, number] | null = null;
  #columns: Columns = { x: [], angle: [], command: [] };
  #end: () => void;
  #resize: ResizeObserver;
  seconds = 10;
  rateHz = 10;
  /** Our monotonic time at which the picture was frozen; null while it goes on. */
  pausedAt: number | null = null;

  constructor(box: HTMLElement, store: TelemetryStore, uid: string, text: PlotText) {
    this.#box = box;
    this.#store = store;
    this.#uid = uid;
    this.#text = text;
    this.#end = everyFrame(box, FPS, now => this.#draw(now));
    this.#resize = new ResizeObserver(() => this.#fit());
    this.#resize.observe(box);
  }

  destroy(): void {
    this.#end();
    this.#resize.disconnect();
    this.#plot?.destroy();
  }

  #fit(): void {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (this.#plot && width > 0 && height > 0) this.#plot.setSize({ width, height });
  }

  #draw(now: number): void {
    const theme = document.documentElement.dataset.theme ?? "";
    if (this.#plot === null || theme !== this.#theme) this.#make(theme);
    const at = this.#store.serverTime(this.pausedAt ?? now);
    if (Number.isNaN(at)) return;
    const from = at - this.seconds;
    const gap = Math.max(0.35, GAP_PERIODS / Math.max(this.rateHz, 1));
    const angle = this.#store.ring(this.#uid, "current_angle").since(from);
    const command = this.#store.ring(this.#uid, "command_angle").since(from);
    this.#columns = merge(angle, command, at, gap);
    this.#range = calmRange(this.#columns, this.#range);
    const { x, angle: a, command: c } = this.#columns;
    this.#plot?.batch(() => {
      this.#plot?.setData([x, c, a] as uPlot.AlignedData, false);
      this.#plot?.setScale("x", { min: -this.seconds, max: 0 });
      const [min, max] = this.#range ?? [-10, 10];
      this.#plot?.setScale("y", { min, max });
    });
  }

  #make(theme: string): void {
    this.#plot?.destroy();
    this.#theme = theme;
    const colours = palette();
    const font = `12px ${colours.font}`;
    const grid = { stroke: colours.line, width: 1 };
    this.#plot = new uPlot(
      {
        width: Math.max(50, this.#box.clientWidth),
        height: Math.max(50, this.#box.clientHeight),
        padding: [8, 18, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false, auto: false }, y: { auto: false } },
        axes: [
          {
            stroke: colours.ink2,
            font,
            size: 30,
            gap: 6,
            space: 60,
            grid: { show: false },
            ticks: { stroke: colours.edge, width: 1, size: 4 },
            values: (_plot, splits) => splits.map(v => (v === 0 ? this.#text.now : this.#text.seconds(v))),
          },
          {
            stroke: colours.ink2,
            font,
            size: 48,
            gap: 6,
            space: 36,
            grid,
            ticks: { show: false },
            values: (_plot, splits) => splits.map(v => this.#text.degrees(v)),
          },
        ],
        series: [
          {},
          { stroke: colours.intent, width: 1.6, dash: [7, 5], points: { show: false } },
          { stroke: colours.ink, width: 1.8, points: { show: false } },
        ],
        hooks: {
          drawClear: [
            plot => {
              plot.ctx.fillStyle = colours.well;
              plot.ctx.fillRect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
            },
          ],
          draw: [plot => this.#names(plot)],
        },
      },
      [[], [], []],
      this.#box,
    );
  }

  /** Names stand at the curves: colour alone tells nobody which is which. */
  #names(plot: uPlot): void {
    const colours = palette();
    const ratio = devicePixelRatio || 1;
    plot.ctx.save();
    plot.ctx.font = `${12 * ratio}px ${colours.font}`;
    const { angle, command, x } = this.#columns;
    const at = -this.seconds * 0.42;
    const place = (column: Cell[]): { x: number; value: number } | null => {
      for (let i = x.length - 1; i >= 0; i--) {
        const value = column[i];
        const t = x[i] ?? 0;
        if (t <= at && value !== null && value !== undefined) return { x: t, value };
      }
      return null;
    };
    const names = [
      { at: place(command), name: this.#text.command, colour: colours.intent },
      { at: place(angle), name: this.#text.angle, colour: colours.ink },
    ].flatMap(({ at, ...one }) =>
      at === null ? [] : [{ ...one, x: at.x, top: plot.valToPos(at.value, "y", true) }],
    );
    names.sort((one, other) => one.top - other.top);
    const low = plot.bbox.top + 14 * ratio;
    const high = plot.bbox.top + plot.bbox.height - 6 * ratio;
    // The upper curve is named above itself, the lower below; never nearer to each other than a line.
    const tops = names.map((one, i) => one.top + (i === 0 && names.length > 1 ? -7 : 17) * ratio);
    for (let i = tops.length - 1; i >= 0; i--) {
      const below = tops[i + 1];
      const most = below === undefined ? high : below - LINE_PX * ratio;
      tops[i] = Math.min(most, Math.max(low + i * LINE_PX * ratio, tops[i] ?? low));
    }
    names.forEach((one, i) => {
      plot.ctx.fillStyle = one.colour;
      plot.ctx.textAlign = "left";
      plot.ctx.fillText(one.name, plot.valToPos(one.x, "x", true), tops[i] ?? low);
    });
    plot.ctx.restore();
  }
}
