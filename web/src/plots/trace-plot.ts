/** A plot of traces that are finished: real samples over time, targets, bands, marks; zoomed by dragging. */
import uPlot from "uplot";
import { clip, colourOf, curveOf, ground, projection, upright } from "./draw";
import { everyFrame } from "./frames";
import { type Palette, palette } from "./palette";
import { Playhead } from "./playhead";
import { shape } from "./shapes";
import { extent, nearestSample, type Samples } from "./trace";

export interface Curve {
  samples: Samples;
  /** A place among the series colours, or what is measured alone, or what was commanded. */
  colour: number | "ink" | "intent";
  /** Commands are dashed, measured curves never. */
  dashed?: boolean;
  /** Holds each value until the next one. */
  held?: boolean;
  bold?: boolean;
  /** Stands at the curve. */
  tag?: string;
  /** Place of the shape its samples have; without one they are dots. */
  shape?: number;
  /** Where a pointer is, this is said of it; nothing without. */
  name?: string;
}

export interface Band {
  low: number;
  high: number;
  label: string;
}

export interface MarkLine {
  t: number;
  label: string;
}

export interface Picture {
  curves: readonly Curve[];
  bands?: readonly Band[];
  marks?: readonly MarkLine[];
  from: number;
  to: number;
  /** The least height in units of y, so that noise does not fill the plot. */
  least: number;
}

export interface TraceText {
  x: (value: number, step: number) => string;
  y: (value: number, step: number) => string;
  /** What is said of a moment: its time, and what each named curve was. */
  at: (time: number, values: readonly { name: string; value: number }[]) => string;
}

const LOOK_HZ = 10;
const DOTS_PX = 6;
const SHAPES_PX = 64;
const TAG_PX = 18;

export class TracePlot {
  #box: HTMLElement;
  #readout: HTMLElement | null;
  #text: TraceText;
  #group: string | null;
  #plot: uPlot | null = null;
  #theme = "";
  #picture: Picture = { curves: [], from: 0, to: 1, least: 1 };
  #view: [number, number] | null = null;
  #head = new Playhead();
  #moment: number | null = null;
  #end: () => void;
  #resize: ResizeObserver;

  /** Plots of a group share their cursor and their zoom. */
  constructor(box: HTMLElement, readout: HTMLElement | null, text: TraceText, group: string | null = null) {
    this.#box = box;
    this.#readout = readout;
    this.#text = text;
    this.#group = group;
    this.#end = everyFrame(box, LOOK_HZ, () => this.#look());
    this.#resize = new ResizeObserver(() => this.#fit());
    this.#resize.observe(box);
  }

  show(picture: Picture): void {
    this.#picture = picture;
    if (!this.#plot) return;
    this.#plot.setData(this.#data(), false);
    this.#zoom();
  }

  /** Shows this part of the time; null: all of it. */
  look(view: [number, number] | null): void {
    this.#view = view;
    this.#zoom();
  }

  /** Draws a line at the moment that is looked at; null: none. */
  head(moment: number | null): void {
    this.#moment = moment;
    this.#place();
  }

  destroy(): void {
    this.#end();
    this.#resize.disconnect();
    this.#plot?.destroy();
    if (this.#readout) this.#readout.textContent = "";
  }

  #place(): void {
    const { min, max } = this.#plot?.scales.x ?? {};
    if (!this.#plot || min === undefined || max === undefined) return;
    this.#head.place(this.#plot.over, this.#moment === null ? null : (this.#moment - min) / (max - min));
  }

  #data(): uPlot.AlignedData {
    return [
      [this.#picture.from, this.#picture.to],
      [0, 0],
    ];
  }

  #zoom(): void {
    const [min, max] = this.#view ?? [this.#picture.from, this.#picture.to];
    this.#plot?.setScale("x", { min, max });
  }

  #fit(): void {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (this.#plot && width > 0 && height > 0) this.#plot.setSize({ width, height });
  }

  #look(): void {
    const theme = document.documentElement.dataset.theme ?? "";
    if (this.#plot !== null && theme === this.#theme) return;
    this.#theme = theme;
    this.#make();
  }

  #make(): void {
    this.#plot?.destroy();
    const colours = palette();
    const font = `12px ${colours.font}`;
    const grid = { stroke: colours.line, width: 1 };
    this.#plot = new uPlot(
      {
        width: Math.max(50, this.#box.clientWidth),
        height: Math.max(50, this.#box.clientHeight),
        padding: [10, 30, 0, 0],
        legend: { show: false },
        cursor: {
          y: false,
          points: { show: false },
          drag: { x: true, y: false, setScale: true },
          ...(this.#group === null ? {} : { sync: { key: this.#group } }),
        },
        scales: {
          x: { time: false, auto: false, min: this.#picture.from, max: this.#picture.to },
          y: { range: plot => this.#height(plot) },
        },
        axes: [
          {
            stroke: colours.ink2,
            font,
            size: 30,
            gap: 6,
            space: 64,
            grid: { show: false },
            ticks: { stroke: colours.edge, width: 1, size: 4 },
            values: (_plot, splits, _axis, _space, step) => splits.map(v => this.#text.x(v, step)),
          },
          {
            stroke: colours.ink2,
            font,
            size: 56,
            gap: 6,
            space: 32,
            grid,
            ticks: { show: false },
            values: (_plot, splits, _axis, _space, step) => splits.map(v => this.#text.y(v, step)),
          },
        ],
        series: [{}, { paths: () => null, points: { show: false } }],
        hooks: {
          drawClear: [plot => ground(plot, colours)],
          draw: [plot => this.#draw(plot, colours), () => this.#place()],
          setCursor: [plot => this.#say(plot)],
        },
      },
      this.#data(),
      this.#box,
    );
    this.#zoom();
  }

  #height(plot: uPlot): [number, number] {
    const { from, to, curves, bands, least } = this.#picture;
    const min = plot.scales.x?.min ?? from;
    const max = plot.scales.x?.max ?? to;
    const found = extent(
      curves.map(one => one.samples),
      min,
      max,
    );
    let [low, high] = found ?? [0, 0];
    for (const band of bands ?? []) {
      low = Math.min(low, band.low);
      high = Math.max(high, band.high);
    }
    const room = Math.max(0, least - (high - low)) / 2 + 0.09 * Math.max(least, high - low);
    return [low - room, high + room];
  }

  #draw(plot: uPlot, colours: Palette): void {
    const { ctx } = plot;
    const ratio = devicePixelRatio || 1;
    clip(plot);
    for (const band of this.#picture.bands ?? []) this.#band(plot, band, colours);
    for (const mark of this.#picture.marks ?? []) this.#mark(plot, mark, colours);
    for (const curve of this.#picture.curves) this.#curve(plot, curve, colours);
    for (const band of this.#picture.bands ?? []) this.#bandLabel(plot, band, colours);
    const tagged = this.#picture.curves.filter(one => one.tag !== undefined);
    tagged.forEach((curve, place) => {
      this.#tag(plot, curve, place, colours);
    });
    ctx.restore();
    ctx.font = `${12 * ratio}px ${colours.font}`;
  }

  #band(plot: uPlot, band: Band, colours: Palette): void {
    const { ctx, bbox } = plot;
    const top = plot.valToPos(band.high, "y", true);
    const bottom = plot.valToPos(band.low, "y", true);
    ctx.fillStyle = colours.limit;
    ctx.globalAlpha = 0.2;
    ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    ctx.globalAlpha = 1;
  }

  /** Above the band and above every curve, with a halo that parts it from them. */
  #bandLabel(plot: uPlot, band: Band, colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const x = bbox.left + bbox.width - 8 * ratio;
    const y = plot.valToPos(band.high, "y", true) - 5 * ratio;
    ctx.font = `${12 * ratio}px ${colours.font}`;
    ctx.textAlign = "right";
    ctx.textBaseline = "alphabetic";
    ctx.strokeStyle = colours.well;
    ctx.lineJoin = "round";
    ctx.lineWidth = 5 * ratio;
    ctx.strokeText(band.label, x, y);
    ctx.fillStyle = colours.limit;
    ctx.fillText(band.label, x, y);
  }

  #mark(plot: uPlot, mark: MarkLine, colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const x = Math.round(plot.valToPos(mark.t, "x", true));
    upright(plot, x, colours.ink3);
    ctx.fillStyle = colours.ink2;
    ctx.font = `${12 * ratio}px ${colours.font}`;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.fillText(mark.label, x + 5 * ratio, bbox.top + 13 * ratio);
  }

  #curve(plot: uPlot, curve: Curve, colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const line = curveOf(plot, projection(plot), curve.samples, { held: curve.held === true });
    if (curve.held && line.end) line.path.lineTo(bbox.left + bbox.width, line.end.y);
    ctx.strokeStyle = colourOf(curve.colour, colours);
    ctx.lineWidth = (curve.bold ? 2.2 : curve.dashed ? 1.6 : 1.5) * ratio;
    ctx.lineJoin = "round";
    ctx.setLineDash(curve.dashed ? [7 * ratio, 5 * ratio] : []);
    ctx.stroke(line.path);
    ctx.setLineDash([]);
    if (!curve.dashed && !curve.held) this.#points(plot, curve, line.first, line.last, colours);
  }

  /** Every sample where there is room for them; else, where curves have shapes, one now and then. */
  #points(plot: uPlot, curve: Curve, first: number, end: number, colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const { t, v } = curve.samples;
    const apart = bbox.width / ratio / Math.max(1, end - first);
    if (apart < DOTS_PX && curve.shape === undefined) return;
    const every = apart >= DOTS_PX ? 0 : SHAPES_PX;
    const outline = new Path2D(
      curve.shape === undefined ? "M1.8 0A1.8 1.8 0 1 1 -1.8 0A1.8 1.8 0 1 1 1.8 0z" : shape(curve.shape),
    );
    const all = new Path2D();
    // Where curves lie on one another their shapes should not.
    let last = bbox.left / ratio - SHAPES_PX / 2 + (curve.shape ?? 0) * (SHAPES_PX / 8);
    for (let i = first; i < end; i++) {
      const value = v[i] ?? Number.NaN;
      if (Number.isNaN(value)) continue;
      const x = plot.valToPos(t[i] ?? 0, "x", true) / ratio;
      if (every > 0 && x - last < every) continue;
      last = x;
      const y = plot.valToPos(value, "y", true) / ratio;
      all.addPath(outline, new DOMMatrix().scale(ratio).translate(x, y));
    }
    ctx.fillStyle = colourOf(curve.colour, colours);
    ctx.fill(all);
  }

  /** Letters stand at the curves, each at a time of its own, in turn above and below. */
  #tag(plot: uPlot, curve: Curve, place: number, colours: Palette): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio || 1;
    const min = plot.scales.x?.min ?? 0;
    const max = plot.scales.x?.max ?? 1;
    const at = nearestSample(curve.samples, min + (max - min) * (0.26 + 0.085 * place));
    const value = curve.samples.v[at] ?? Number.NaN;
    if (at < 0 || Number.isNaN(value)) return;
    const x = plot.valToPos(curve.samples.t[at] ?? 0, "x", true);
    const side = place % 2 === 0 ? -1 : 1;
    const high = bbox.top + (TAG_PX / 2 + 2) * ratio;
    const low = bbox.top + bbox.height - (TAG_PX / 2 + 2) * ratio;
    const y = Math.min(low, Math.max(high, plot.valToPos(value, "y", true) + side * 18 * ratio));
    const half = (TAG_PX / 2) * ratio;
    ctx.fillStyle = colours.well;
    ctx.strokeStyle = colourOf(curve.colour, colours);
    ctx.lineWidth = 1.5 * ratio;
    ctx.beginPath();
    ctx.roundRect(x - half, y - half, 2 * half, 2 * half, 2 * ratio);
    ctx.fill();
    ctx.stroke();
    ctx.fillStyle = colours.ink;
    ctx.font = `600 ${12 * ratio}px ${colours.font}`;
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    ctx.fillText(curve.tag ?? "", x, y + 0.5 * ratio);
  }

  #say(plot: uPlot): void {
    if (!this.#readout) return;
    const left = plot.cursor.left ?? -1;
    if (left < 0) {
      this.#readout.textContent = "";
      return;
    }
    const at = plot.posToVal(left, "x");
    const values = this.#picture.curves.flatMap(curve => {
      if (curve.name === undefined) return [];
      const index = nearestSample(curve.samples, at);
      const value = curve.samples.v[index] ?? Number.NaN;
      return index < 0 || Number.isNaN(value) ? [] : [{ name: curve.name, value }];
    });
    this.#readout.textContent = this.#text.at(at, values);
  }
}
