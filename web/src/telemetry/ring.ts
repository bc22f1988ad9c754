/** Samples of one signal: a ring whose newest part is always one contiguous window of typed arrays. */

export interface Window {
  t: Float64Array;
  v: Float64Array;
}

/** Size limits of a ring: `seconds` of samples, at most `most` samples. */
export interface Growth {
  most: number;
  seconds: number;
}

/**
 * Each sample is written twice, one capacity apart, so that any run of up to `capacity` samples is contiguous and a
 * plot can use it without a copy. A gap is a sample with v = NaN.
 */
export class Ring {
  #capacity: number;
  #growth: Growth;
  #t: Float64Array;
  #v: Float64Array;
  #next = 0;
  #length = 0;

  constructor(capacity: number, growth: Growth = { most: capacity, seconds: 0 }) {
    if (!Number.isInteger(capacity) || capacity < 1) throw new RangeError("a ring needs room for a sample");
    this.#capacity = capacity;
    this.#growth = growth;
    this.#t = new Float64Array(2 * capacity);
    this.#v = new Float64Array(2 * capacity);
  }

  get capacity(): number {
    return this.#capacity;
  }

  get length(): number {
    return this.#length;
  }

  /** Add a sample. Samples not newer than the last one are dropped. */
  push(t: number, v: number): boolean {
    if (this.#length > 0 && t <= this.lastTime) return false;
    if (this.#length === this.#capacity && t - this.firstTime < this.#growth.seconds) {
      const { t: times, v: values } = this.all();
      this.#rebuild(2 * this.#capacity, times, values);
    }
    this.#put(t, v);
    return true;
  }

  /** Add samples from before the oldest one, oldest first; newer ones are dropped. */
  prepend(t: ArrayLike<number>, v: ArrayLike<number>): void {
    const { t: times, v: values } = this.all();
    const until = times[0] ?? Number.POSITIVE_INFINITY;
    let count = 0;
    while (count < t.length && (t[count] ?? Number.POSITIVE_INFINITY) < until) count++;
    const room = Math.max(this.#capacity, this.#growth.most) - times.length;
    const first = Math.max(0, count - room);
    if (count === first) return;
    const total = times.length + count - first;
    const allTimes = new Float64Array(total);
    const allValues = new Float64Array(total);
    for (let i = first; i < count; i++) {
      allTimes[i - first] = t[i] ?? 0;
      allValues[i - first] = v[i] ?? Number.NaN;
    }
    allTimes.set(times, count - first);
    allValues.set(values, count - first);
    let capacity = this.#capacity;
    while (capacity < total) capacity *= 2;
    this.#rebuild(capacity, allTimes, allValues);
  }

  clear(): void {
    this.#length = 0;
    this.#next = 0;
  }

  /** Time of the newest sample, NaN while empty. */
  get lastTime(): number {
    return this.#length === 0 ? Number.NaN : (this.#t[this.#last] ?? Number.NaN);
  }

  /** Time of the oldest sample, NaN while empty. */
  get firstTime(): number {
    return this.#length === 0 ? Number.NaN : (this.#t[this.#end - this.#length] ?? Number.NaN);
  }

  /** Value of the newest sample, NaN while empty or in a gap. */
  get lastValue(): number {
    return this.#length === 0 ? Number.NaN : (this.#v[this.#last] ?? Number.NaN);
  }

  /** The samples not older than `from`, oldest first, plus the previous one, so that a line enters at the edge. */
  since(from: number): Window {
    const end = this.#end;
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

  /** All samples, oldest first. */
  all(): Window {
    return this.since(Number.NEGATIVE_INFINITY);
  }

  #put(t: number, v: number): void {
    const at = this.#next;
    this.#t[at] = this.#t[at + this.#capacity] = t;
    this.#v[at] = this.#v[at + this.#capacity] = v;
    this.#next = (at + 1) % this.#capacity;
    this.#length = Math.min(this.#capacity, this.#length + 1);
  }

  #rebuild(wanted: number, times: Float64Array, values: Float64Array): void {
    const capacity = Math.max(this.#capacity, Math.min(wanted, this.#growth.most));
    this.#t = new Float64Array(2 * capacity);
    this.#v = new Float64Array(2 * capacity);
    this.#capacity = capacity;
    this.clear();
    for (let i = 0; i < times.length; i++) this.#put(times[i] ?? 0, values[i] ?? Number.NaN);
  }

  get #last(): number {
    return this.#next === 0 ? this.#capacity - 1 : this.#next - 1;
  }

  get #end(): number {
    return this.#next === 0 ? 2 * this.#capacity : this.#next + this.#capacity;
  }
}
