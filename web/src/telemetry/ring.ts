/** Owns samples of one signal: a ring whose newest part is always one contiguous window of typed arrays. */

export interface Window {
  t: Float64Array;
  v: Float64Array;
}

/**
 * Each sample is written twice, one capacity apart, so any run of up to `capacity` samples is contiguous and a
 * plot can take it as it is. A gap is a sample with v = NaN.
 */
export class Ring {
  readonly capacity: number;
  #t: Float64Array;
  #v: Float64Array;
  #next = 0;
  #length = 0;

  constructor(capacity: number) {
    if (!Number.isInteger(capacity) || capacity < 1) throw new RangeError("a ring needs room for a sample");
    this.capacity = capacity;
    this.#t = new Float64Array(2 * capacity);
    this.#v = new Float64Array(2 * capacity);
  }

  get length(): number {
    return this.#length;
  }

  /** Adds a sample. One that is not newer than the last is left out: time only goes forward here. */
  push(t: number, v: number): boolean {
    if (this.#length > 0 && t <= this.lastTime) return false;
    const at = this.#next;
    this.#t[at] = this.#t[at + this.capacity] = t;
    this.#v[at] = this.#v[at + this.capacity] = v;
    this.#next = (at + 1) % this.capacity;
    this.#length = Math.min(this.capacity, this.#length + 1);
    return true;
  }

  clear(): void {
    this.#length = 0;
    this.#next = 0;
  }

  /** Time of the newest sample, NaN while empty. */
  get lastTime(): number {
    return this.#length === 0 ? Number.NaN : (this.#t[this.#last] ?? Number.NaN);
  }

  /** Value of the newest sample, NaN while empty or in a gap. */
  get lastValue(): number {
    return this.#length === 0 ? Number.NaN : (this.#v[this.#last] ?? Number.NaN);
  }

  /** The samples not older than `from`, oldest first, plus the one before so that a line enters at the edge. */
  since(from: number): Window {
    const end = this.#next === 0 ? 2 * this.capacity : this.#next + this.capacity;
    const oldest = end - this.#length;
    let low = oldest;
    let high = end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.#t[middle] ?? 0) < from) low = middle + 1;
      else high = middle;
    }
    const begin = Math.max(oldest, low - 1);
    return { t: this.#t.subarray(begin, end), v: this.#v.subarray(begin, end) };
  }

  get #last(): number {
    return this.#next === 0 ? this.capacity - 1 : this.#next - 1;
  }
}
