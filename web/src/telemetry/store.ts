/** The rings by servo and channel, and the relation of the server's clock to ours. No signals here. */
import { Ring } from "./ring";

/** Room at first, and what a ring grows to: the memory of the scope, at most of 100 samples a second. */
const CAPACITY = 512;
export const KEPT_S = 610;
const GROWTH = { most: 65_536, seconds: KEPT_S };

export interface Sample {
  value: number;
  /** Seconds since it was taken. */
  age: number;
}

export class TelemetryStore {
  #rings = new Map<string, Ring>();
  #offset = Number.POSITIVE_INFINITY;
  #offsetAt = 0;
  /** What the server's clock lacks to UTC, in seconds; NaN until it is told. */
  utcOffset = Number.NaN;

  /** Takes a batch of one channel; `arrived` is our monotonic clock in seconds. */
  push(uid: string, channel: string, t: number[], v: (number | null)[], arrived: number): void {
    const ring = this.ring(uid, channel);
    for (let i = 0; i < t.length; i++) {
      const time = t[i];
      if (time !== undefined) ring.push(time, v[i] ?? Number.NaN);
    }
    const last = t.at(-1);
    if (last !== undefined) this.#align(arrived - last, arrived);
  }

  /** Takes what was before the oldest sample of a channel; NaN is a gap. */
  pushPast(uid: string, channel: string, t: ArrayLike<number>, v: ArrayLike<number>): void {
    this.ring(uid, channel).prepend(t, v);
  }

  /** Takes a channel that is all there, of a recording, however long it is. */
  keep(uid: string, channel: string, t: ArrayLike<number>, v: ArrayLike<number>): void {
    const ring = new Ring(Math.max(1, t.length));
    for (let i = 0; i < t.length; i++) ring.push(t[i] ?? 0, v[i] ?? Number.NaN);
    this.#rings.set(`${uid}/${channel}`, ring);
  }

  ring(uid: string, channel: string): Ring {
    const name = `${uid}/${channel}`;
    let ring = this.#rings.get(name);
    if (!ring) {
      ring = new Ring(CAPACITY, GROWTH);
      this.#rings.set(name, ring);
    }
    return ring;
  }

  /** The server's clock at our time `now`; NaN before the first batch. */
  serverTime(now: number): number {
    return Number.isFinite(this.#offset) ? now - this.#offset : Number.NaN;
  }

  /** The newest sample of a channel and its age, or null when there is none or it is a gap. */
  latest(uid: string, channel: string, now: number): Sample | null {
    const ring = this.#rings.get(`${uid}/${channel}`);
    if (!ring || ring.length === 0 || Number.isNaN(ring.lastValue)) return null;
    return { value: ring.lastValue, age: Math.max(0, this.serverTime(now) - ring.lastTime) };
  }

  /** Forgets everything: after a new connection the server's clock may be another one. */
  clear(): void {
    this.#rings.clear();
    this.#offset = Number.POSITIVE_INFINITY;
  }

  // The least delayed batch tells the offset best; the bound rises by a millisecond a second, as clocks drift.
  #align(offset: number, arrived: number): void {
    const relaxed = this.#offset + (arrived - this.#offsetAt) * 0.001;
    this.#offset = Math.min(offset, relaxed);
    this.#offsetAt = arrived;
  }
}

export const telemetry = new TelemetryStore();
