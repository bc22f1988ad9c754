/** Rings by servo and channel, and the offset of the server's clock. No signals here. */
import { Ring } from "./ring";

/** Initial size of a ring, and its limit: the scope's memory, at up to 100 samples per second. */
const CAPACITY = 512;
export const KEPT_S = 610;
const GROWTH = { most: 65_536, seconds: KEPT_S };

export interface Sample {
  value: number;
  /** Age, seconds. */
  age: number;
}

export class TelemetryStore {
  #rings = new Map<string, Ring>();
  #offset = Number.POSITIVE_INFINITY;
  #offsetAt = 0;
  /** Offset of the server's clock to UTC, seconds; NaN until known. */
  utcOffset = Number.NaN;

  /** Add a batch of one channel; `arrived` is the monotonic time of arrival, seconds. */
  push(uid: string, channel: string, t: number[], v: (number | null)[], arrived: number): void {
    const ring = this.ring(uid, channel);
    for (let i = 0; i < t.length; i++) {
      const time = t[i];
      if (time !== undefined) ring.push(time, v[i] ?? Number.NaN);
    }
    const last = t.at(-1);
    if (last !== undefined) this.#align(arrived - last, arrived);
  }

  /** Add samples from before the oldest one of a channel; NaN is a gap. */
  pushPast(uid: string, channel: string, t: ArrayLike<number>, v: ArrayLike<number>): void {
    this.ring(uid, channel).prepend(t, v);
  }

  /** Store a complete channel of a recording, of any length. */
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

  /** The server's clock at monotonic time `now`; NaN before the first batch. */
  serverTime(now: number): number {
    return Number.isFinite(this.#offset) ? now - this.#offset : Number.NaN;
  }

  /** The newest sample of a channel and its age; null if there is none or it is a gap. */
  latest(uid: string, channel: string, now: number): Sample | null {
    const ring = this.#rings.get(`${uid}/${channel}`);
    if (!ring || ring.length === 0 || Number.isNaN(ring.lastValue)) return null;
    return { value: ring.lastValue, age: Math.max(0, this.serverTime(now) - ring.lastTime) };
  }

  /** Discard everything: after a new connection the server's clock may differ. */
  clear(): void {
    this.#rings.clear();
    this.#offset = Number.POSITIVE_INFINITY;
  }

  // The least delayed batch gives the best offset; the bound rises by a millisecond per second, for clock drift.
  #align(offset: number, arrived: number): void {
    const relaxed = this.#offset + (arrived - this.#offsetAt) * 0.001;
    this.#offset = Math.min(offset, relaxed);
    this.#offsetAt = arrived;
  }
}

export const telemetry = new TelemetryStore();
