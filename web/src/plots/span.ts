/** What part of time a plot shows and what is marked in it: its lanes share it. Times are the server's clock. */
import { signal } from "@preact/signals";

export const WINDOWS = [5, 10, 30, 60, 300] as const;

/** A part of time that stands still; `zero` is what its axis counts from. */
export interface Still {
  from: number;
  to: number;
  zero: number;
}

export type Cursor = 0 | 1;

/** Nothing shorter is shown: two samples at 500 Hz. */
const SHORTEST_S = 0.004;

export class TimeSpan {
  /** How long a window follows. */
  readonly seconds = signal<number>(10);
  /** null while the picture follows. */
  readonly still = signal<Still | null>(null);
  readonly cursors = signal<readonly [number | null, number | null]>([null, null]);
  /** What is being chosen by dragging. */
  readonly drag = signal<{ from: number; to: number } | null>(null);
  /** The moment of a recording that is looked at. */
  readonly head = signal<number | null>(null);
  /** The curve that stands out, by its key. */
  readonly lit = signal<string | null>(null);
  /** What was drawn last: what somebody saw who pauses, or points at it. */
  drawn: Still | null = null;
  #now: () => number;
  #most: Still | null;
  #placed: Cursor = 1;

  /** `now` is the server's time; `most` is all there is of something that does not go on. */
  constructor(now: () => number, most: Still | null = null) {
    this.#now = now;
    this.#most = most;
    this.still.value = most;
  }

  /** Whether it is of something that goes on. */
  get goesOn(): boolean {
    return this.#most === null;
  }

  /** What is shown now; null before anything was heard. */
  shown(): Still | null {
    const still = this.still.peek();
    if (still) return still;
    const now = this.#now();
    return Number.isNaN(now) ? null : { from: now - this.seconds.peek(), to: now, zero: now };
  }

  pause(): void {
    this.still.value ??= this.drawn ?? this.shown();
  }

  /** Shows a part of time, and stands still. */
  zoom(one: number, other: number): void {
    this.pause();
    const shown = this.still.peek();
    if (!shown) return;
    const from = Math.min(one, other);
    const to = Math.max(from + SHORTEST_S, Math.max(one, other));
    this.still.value = { from, to, zero: shown.zero };
  }

  /** Follows again, or shows all there is; cursors go, for they were set on a picture that stood still. */
  follow(): void {
    this.drawn = null;
    this.still.value = this.#most;
    this.cursors.value = [null, null];
    this.drag.value = null;
  }

  /** Whether a part was chosen, or time stopped, so that there is a way back. */
  get away(): boolean {
    return this.still.value !== this.#most;
  }

  choose(seconds: number): void {
    this.seconds.value = seconds;
    this.follow();
  }

  /** Puts a cursor: the first one, then the second, then whichever is nearer. The picture stands still from then on. */
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

  /** Both cursors at a third of what is shown, for those who have no pointer; or none, if there were any. */
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

  /** The cursor that was moved last: arrow keys on the plot move it. */
  get active(): Cursor {
    return this.#placed;
  }

  /** Between the cursors only. */
  zoomToCursors(): void {
    const [a, b] = this.cursors.peek();
    if (a !== null && b !== null && a !== b) this.zoom(a, b);
  }
}
