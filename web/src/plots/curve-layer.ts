/**
 * The measured curves of a plot that follows the present: a picture that moves left by whole pixels, so that only what
 * is new has to be drawn at its right. It is the same picture as when everything is drawn.
 */
import type uPlot from "uplot";
import { linePath, type PlotCurve, type Projection } from "./series";
import { inSight } from "./trace";

export interface Pen {
  colour: string;
  alpha: number;
  /** Device pixels. */
  width: number;
}

/** Samples of a curve at its last draw. */
interface Seen {
  first: number;
  last: number;
  /** What is older than this sample does not change; whether the last line is one at all depends on the next sample. */
  settled: number;
}

/** Room around the face for half of the widest line, device pixels. */
const EDGE = 4;

export class CurveLayer {
  #canvas = document.createElement("canvas");
  #look = "";
  #left = Number.NaN;
  #seen: Seen[] = [];

  /** Draw curves, which must be plain, into a plot. Another `look` than before draws all of them again. */
  draw(plot: uPlot, at: Projection, curves: readonly { curve: PlotCurve; pen: Pen }[], look: string): void {
    const box = plot.bbox;
    const across = box.width / (at.max - at.min);
    const left = Math.round(at.min * across);
    const moved = left - this.#left;
    const seen = curves.map(({ curve }) => seenOf(curve, at));
    const size = [box.width + 2 * EDGE, box.height + 2 * EDGE] as const;
    const whole =
      this.#look !== look ||
      !(moved >= 0 && moved < box.width) ||
      seen.some((one, i) => older(one, this.#seen[i]));
    const ctx = this.#canvas.getContext("2d");
    if (!ctx) return;
    let from = 0;
    if (whole) {
      [this.#canvas.width, this.#canvas.height] = size;
    } else {
      const fresh = seen.flatMap((one, i) => {
        const before = this.#seen[i];
        return before && !Object.is(one.last, before.last) ? [before.settled] : [];
      });
      from = Math.min(...fresh.map(t => Math.floor(at.x(t) - box.left)), size[0] - moved);
      from = Math.max(0, from);
      if (moved > 0) {
        ctx.globalCompositeOperation = "copy";
        ctx.drawImage(this.#canvas, -moved, 0);
        ctx.globalCompositeOperation = "source-over";
      }
      ctx.clearRect(from, 0, size[0], size[1]);
    }
    ctx.save();
    ctx.beginPath();
    ctx.rect(from, 0, size[0], size[1]);
    ctx.clip();
    ctx.translate(EDGE - box.left, EDGE - box.top);
    ctx.lineJoin = "round";
    const since = at.min + (from - 2 * EDGE) / across;
    for (const { curve, pen } of curves) {
      ctx.strokeStyle = pen.colour;
      ctx.globalAlpha = pen.alpha;
      ctx.lineWidth = pen.width;
      ctx.stroke(linePath(plot, at, curve, since).stroke);
    }
    ctx.restore();
    this.#look = look;
    this.#left = left;
    this.#seen = seen;
    const rim = EDGE - 1;
    const [width, height] = [size[0] - 2 * rim, size[1] - 2 * rim];
    plot.ctx.drawImage(this.#canvas, rim, rim, width, height, box.left - 1, box.top - 1, width, height);
  }
}

function seenOf(curve: PlotCurve, at: Projection): Seen {
  const { t } = curve.samples(at.min);
  const [, end] = inSight(t, at.min, at.max);
  return {
    first: t[0] ?? Number.NaN,
    last: t[end - 1] ?? Number.NaN,
    settled: t[Math.max(0, end - 2)] ?? at.min,
  };
}

/** Whether samples were put before the others, or all were replaced. */
function older(now: Seen, before: Seen | undefined): boolean {
  if (!before || Number.isNaN(now.first) !== Number.isNaN(before.first)) return true;
  return now.first < before.first || now.first > before.last || now.last < before.last;
}
