/** The plot of the bus load over the last minute, with the limit it is kept within. */
import type { BusHistory } from "../telemetry/bus-history";
import { everyFrame } from "./frames";
import { palette } from "./palette";

export interface LoadText {
  limit: string;
  now: string;
  seconds: (before: number) => string;
  percent: (value: number) => string;
}

export const LOAD_SPAN_S = 60;
/** The bus is told about once a second: further apart than this is a gap. */
const GAP_S = 3.5;
const FPS = 5;
const LEFT = 46;
const RIGHT = 10;
const TOP = 12;
const BOTTOM = 24;
const STEP_PCT = 20;
const LEAST_PCT = 60;
const TICKS_S = [60, 40, 20, 0];

export class LoadPlot {
  #canvas: HTMLCanvasElement;
  #history: BusHistory;
  #text: LoadText;
  #end: () => void;
  /** The limit in %; null while it is not known. */
  cap: number | null = null;

  constructor(canvas: HTMLCanvasElement, history: BusHistory, text: LoadText) {
    this.#canvas = canvas;
    this.#history = history;
    this.#text = text;
    this.#end = everyFrame(canvas, FPS, now => this.#draw(now));
  }

  destroy(): void {
    this.#end();
  }

  #draw(now: number): void {
    const box = this.#canvas;
    const { clientWidth: width, clientHeight: height } = box;
    const ratio = Math.min(2, devicePixelRatio || 1);
    if (box.width !== Math.round(width * ratio) || box.height !== Math.round(height * ratio)) {
      box.width = Math.round(width * ratio);
      box.height = Math.round(height * ratio);
    }
    const context = box.getContext("2d");
    if (!context || width === 0) return;
    const colours = palette();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);

    const { t, v } = this.#history.load.since(now - LOAD_SPAN_S);
    let peak = this.cap ?? 0;
    for (const value of v) if (value > peak) peak = value;
    const most = Math.min(100, Math.max(LEAST_PCT, Math.ceil((peak + 5) / STEP_PCT) * STEP_PCT));
    const right = width - RIGHT;
    const base = height - BOTTOM;
    const x = (time: number) => LEFT + ((time - now + LOAD_SPAN_S) / LOAD_SPAN_S) * (right - LEFT);
    const y = (value: number) => base - (Math.min(most, value) / most) * (base - TOP);

    context.fillStyle = colours.well;
    context.fillRect(LEFT, TOP, right - LEFT, base - TOP);
    context.font = `12px ${colours.font}`;
    context.textBaseline = "middle";
    context.textAlign = "right";
    context.lineWidth = 1;
    for (let level = 0; level <= most; level += STEP_PCT) {
      context.strokeStyle = level === 0 ? colours.edge : colours.line;
      line(context, LEFT, y(level), right, y(level));
      const limit = level === this.cap;
      context.fillStyle = limit ? colours.limit : colours.ink2;
      context.fillText(this.#text.percent(level), LEFT - 8, y(level));
    }
    this.#ticks(context, right, base);

    context.save();
    context.beginPath();
    context.rect(LEFT, TOP - 1, right - LEFT, base - TOP + 2);
    context.clip();
    this.#curve(context, t, v, x, y, base);
    context.restore();
    if (this.cap !== null) {
      context.strokeStyle = colours.limit;
      context.lineWidth = 1.5;
      line(context, LEFT, y(this.cap), right, y(this.cap));
      if (this.cap % STEP_PCT !== 0) {
        context.fillStyle = colours.limit;
        context.textAlign = "left";
        context.fillText(this.#text.limit, LEFT + 6, y(this.cap) - 9);
      }
    }
  }

  #ticks(context: CanvasRenderingContext2D, right: number, base: number): void {
    const colours = palette();
    context.textBaseline = "alphabetic";
    for (const before of TICKS_S) {
      const place = right - (before / LOAD_SPAN_S) * (right - LEFT);
      context.strokeStyle = colours.edge;
      line(context, place, base, place, base + 4);
      context.fillStyle = colours.ink2;
      context.textAlign = before === 0 ? "right" : before === LOAD_SPAN_S ? "left" : "center";
      context.fillText(before === 0 ? this.#text.now : this.#text.seconds(-before), place, base + 17);
    }
  }

  #curve(
    context: CanvasRenderingContext2D,
    t: Float64Array,
    v: Float64Array,
    x: (t: number) => number,
    y: (v: number) => number,
    base: number,
  ): void {
    const colours = palette();
    let from = 0;
    const piece = (to: number) => {
      if (to - from < 1) return;
      const path = new Path2D();
      for (let i = from; i < to; i++) path.lineTo(x(t[i] ?? 0), y(v[i] ?? 0));
      const under = new Path2D(path);
      under.lineTo(x(t[to - 1] ?? 0), base);
      under.lineTo(x(t[from] ?? 0), base);
      context.fillStyle = colours.ink;
      context.globalAlpha = 0.08;
      context.fill(under);
      context.globalAlpha = 1;
      context.strokeStyle = colours.ink;
      context.lineWidth = 1.6;
      context.stroke(path);
    };
    for (let i = 0; i < t.length; i++) {
      const gap = Number.isNaN(v[i] ?? Number.NaN);
      const late = i > from && (t[i] ?? 0) - (t[i - 1] ?? 0) > GAP_S;
      if (gap || late) {
        piece(i);
        from = gap ? i + 1 : i;
      }
    }
    piece(t.length);
  }
}

function line(context: CanvasRenderingContext2D, x1: number, y1: number, x2: number, y2: number): void {
  const crisp = (n: number) => Math.round(n) + 0.5;
  context.beginPath();
  context.moveTo(x1 === x2 ? crisp(x1) : x1, y1 === y2 ? crisp(y1) : y1);
  context.lineTo(x1 === x2 ? crisp(x2) : x2, y1 === y2 ? crisp(y2) : y2);
  context.stroke();
}
