/** The time span of a plot and the cursors in it, shared by its lanes. Times are the server's clock. */
import { signal } from "@preact/signals";

export const WINDOWS = [5, 10, 30, 60, 300] as const;

/** A fixed time span; `zero` is the zero of its axis. */
export interface Still {
  from: number;
  to: number;
  zero: number;
}

export type Cursor = 0 | 1;

/** The shortest span: two samples at 500 Hz. */
const SHORTEST_S = 0.004;

export class TimeSpan {
  /** Length of the following window. */
  readonly seconds = signal<number>(10);
  /** Fixed span; null while following. */
  readonly still = signal<Still | null>(null);
  readonly cursors = signal<readonly [number | null, number | null]>([null, null]);
  /** Span being selected by dragging. */
  readonly drag = signal<{ from: number; to: number } | null>(null);
  /** Present moment of a recording. */
  readonly head = signal<number | null>(null);
  /** Key of the highlighted curve. */
  readonly lit = signal<string | null>(null);
  /** Last drawn time: what the user saw when pausing or pointing. */
  drawn: Still | null = null;
  #now: () => number;
  #most: Still | null;
  #placed: Cursor = 1;

  /** `now` is the server's time; `most` is the whole span of data that does not grow. */
  constructor(now: () => number, most: Still | null = null) {
    this.#now = now;
    this.#most = most;
    this.still.value = most;
  }

  /** Whether the data grows. */
  get goesOn(): boolean {
    return this.#most === null;
  }

  /** Span shown now; null before any data. */
  shown(): Still | null {
    const still = this.still.peek();
    if (still) return still;
    const now = this.#now();
    return Number.isNaN(now) ? null : { from: now - this.seconds.peek(), to: now, zero: now };
  }

  pause(): void {
    this.still.value ??= this.drawn ?? this.shown();
  }

  /** Show a fixed span. */
  zoom(one: number, other: number): void {
    this.pause();
    const shown = this.still.peek();
    if (!shown) return;
    const from = Math.min(one, other);
    const to = Math.max(from + SHORTEST_S, Math.max(one, other));
    this.still.value = { from, to, zero: shown.zero };
  }

  /** Follow again, or show everything; removes cursors, which belong to a fixed picture. */
  follow(): void {
    this.drawn = null;
    this.still.value = this.#most;
    this.cursors.value = [null, null];
    this.drag.value = null;
  }

  /** Whether zoomed or paused, so that "Back to live" applies. */
  get away(): boolean {
    return this.still.value !== this.#most;
  }

  choose(seconds: number): void {
    this.seconds.value = seconds;
    this.follow();
  }

  /** Place a cursor: the first, then the second, then the nearer one. The picture is fixed from then on. */
  place(t: number): Cursor {
    this.pause();
    const [a, b] = this.cursors.peek();
    const which: Cursor = a === null ? 0 : b === null ? 1 : Math.abs(t - a) <= Math.abs(t - b) ? 0 : 1;
    this.move(which, t);
    return which;
  }

  move(which: Cursor, t: number): void {
    const shown = this.shown();
    if (!shown) return;
    const at = Math.min(shown.to, Math.max(shown.from, t));
    const [a, b] = this.cursors.peek();
    this.#placed = which;
    this.cursors.value = which === 0 ? [at, b] : [a, at];
  }

  /** Toggle both cursors, placed at thirds of the span, for use without a pointer. */
  flipCursors(): void {
    if (this.cursors.peek().some(one => one !== null)) {
      this.cursors.value = [null, null];
      return;
    }
    this.pause();
    const shown = this.shown();
    if (!shown) return;
    const third = (shown.to - shown.from) / 3;
    this.cursors.value = [shown.from + third, shown.to - third];
  }

  /** The cursor moved last, which arrow keys move. */
  get active(): Cursor {
    return this.#placed;
  }

  /** Zoom to the span between the cursors. */
  zoomToCursors(): void {
    const [a, b] = this.cursors.peek();
    if (a !== null && b !== null && a !== b) this.zoom(a, b);
  }
}
