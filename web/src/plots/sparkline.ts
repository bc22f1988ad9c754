/** One sparkline: the last 30 s of an angle between its limits, ending where the data ends. */
import type { Ring } from "../telemetry/ring";
import type { TelemetryStore } from "../telemetry/store";
import { palette } from "./palette";

export interface SparkLimits {
  cw: number;
  ccw: number;
}

export const SPARKLINE_SPAN_S = 30;
/** The curve is interrupted where samples are further apart than this. */
const GAP_S = 1;
/** Limits wider than this would flatten every curve; then the data sets the scale. */
const WIDEST_DEG = 720;
const PAD = 5;

export class Sparkline {
  #canvas: HTMLCanvasElement;
  #store: TelemetryStore;
  #uid: string;
  limits: SparkLimits | null = null;
  online = true;
  noData = "";

  constructor(canvas: HTMLCanvasElement, store: TelemetryStore, uid: string) {
    this.#canvas = canvas;
    this.#store = store;
    this.#uid = uid;
  }

  draw(now: number): void {
    const box = this.#canvas;
    const width = box.clientWidth;
    const height = box.clientHeight;
    const ratio = Math.min(2, devicePixelRatio || 1);
    if (box.width !== width * ratio || box.height !== height * ratio) {
      box.width = width * ratio;
      box.height = height * ratio;
    }
    const context = box.getContext("2d");
    if (!context) return;
    const colours = palette();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);

    const angles = this.#store.ring(this.#uid, "current_angle");
    const end = this.#store.serverTime(now);
    const window = angles.since(end - SPARKLINE_SPAN_S);
    const scale = this.#scale(window.v, height);
    const x = (t: number) => ((t - end + SPARKLINE_SPAN_S) / SPARKLINE_SPAN_S) * (width - PAD - 1);

    const newest = window.t.at(-1);
    const live = this.online && newest !== undefined && end - newest < GAP_S;
    context.lineWidth = 1;
    if (live && this.limits && scale.limited) {
      context.strokeStyle = colours.limit;
      context.setLineDash([1, 3]);
      for (const limit of [this.limits.cw, this.limits.ccw])
        line(context, 0, scale.y(limit), width, scale.y(limit));
    }
    context.setLineDash([]);
    context.strokeStyle = colours.line;
    const zero = scale.y(0);
    if (live && zero > 0 && zero < height) line(context, 0, zero, width, zero);

    this.#curve(
      context,
      this.#store.ring(this.#uid, "command_angle"),
      end,
      x,
      scale.y,
      colours.intent,
      [3, 2],
    );
    const last = this.#curve(context, angles, end, x, scale.y, this.online ? colours.ink : colours.ink3, []);
    if (last === null) {
      this.#say(context, colours.ink3, width, height / 2 + 4);
      return;
    }
    if (!live) {
      // Dots continue where the curve would.
      context.strokeStyle = colours.ink3;
      context.setLineDash([1, 3]);
      line(context, x(last.t), scale.y(last.v), width, scale.y(last.v));
      context.setLineDash([]);
    }
    context.beginPath();
    context.arc(x(last.t), scale.y(last.v), live ? 3 : 2.5, 0, 2 * Math.PI);
    if (live) {
      context.fillStyle = colours.ink;
      context.fill();
    } else {
      context.fillStyle = colours.panel;
      context.strokeStyle = colours.ink3;
      context.lineWidth = 1.2;
      context.fill();
      context.stroke();
      const low = scale.y(last.v) > height - 18;
      this.#say(context, colours.ink3, width, low ? 12 : height - 2, width - x(last.t));
    }
  }

  #scale(values: Float64Array, height: number): { y: (v: number) => number; limited: boolean } {
    const spread = this.limits ? this.limits.cw - this.limits.ccw : Number.POSITIVE_INFINITY;
    let low = Number.POSITIVE_INFINITY;
    let high = Number.NEGATIVE_INFINITY;
    const limited = this.limits !== null && spread > 0 && spread <= WIDEST_DEG;
    if (limited && this.limits) {
      low = this.limits.ccw;
      high = this.limits.cw;
    } else {
      for (const v of values) {
        if (Number.isNaN(v)) continue;
        low = Math.min(low, v);
        high = Math.max(high, v);
      }
      if (!(high - low > 10)) {
        const middle = Number.isFinite(low) ? (low + high) / 2 : 0;
        low = middle - 5;
        high = middle + 5;
      }
    }
    const inner = height - 2 * PAD;
    return { limited, y: v => PAD + inner * (1 - (Math.min(high, Math.max(low, v)) - low) / (high - low)) };
  }

  #curve(
    context: CanvasRenderingContext2D,
    ring: Ring,
    end: number,
    x: (t: number) => number,
    y: (v: number) => number,
    colour: string,
    dash: number[],
  ): { t: number; v: number } | null {
    const { t, v } = ring.since(end - SPARKLINE_SPAN_S);
    let last: { t: number; v: number } | null = null;
    context.strokeStyle = colour;
    context.lineWidth = dash.length > 0 ? 1 : 1.4;
    context.setLineDash(dash);
    context.beginPath();
    for (let i = 0; i < t.length; i++) {
      const at = t[i] ?? 0;
      const value = v[i] ?? Number.NaN;
      if (Number.isNaN(value)) {
        last = null;
        continue;
      }
      if (last === null || at - last.t > GAP_S) context.moveTo(x(at), y(value));
      else context.lineTo(x(at), y(value));
      last = { t: at, v: value };
    }
    context.stroke();
    context.setLineDash([]);
    return last;
  }

  /** Say that there is no data, unless the text is wider than `room`: it would cover the curve. */
  #say(context: CanvasRenderingContext2D, colour: string, width: number, base: number, room = width): void {
    context.fillStyle = colour;
    context.font = `12px ${palette().font}`;
    if (context.measureText(this.noData).width > room) return;
    context.textAlign = "right";
    context.fillText(this.noData, width, base);
  }
}

function line(context: CanvasRenderingContext2D, x1: number, y1: number, x2: number, y2: number): void {
  context.beginPath();
  context.moveTo(x1, Math.round(y1) + 0.5);
  context.lineTo(x2, Math.round(y2) + 0.5);
  context.stroke();
}
