/** Throttle for values that change faster than they may be sent: the newest wins, one per period. */

export class Newest<T> {
  #period_ms: number;
  #send: (value: T) => void;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #next: { value: T } | null = null;

  constructor(period_ms: number, send: (value: T) => void) {
    this.#period_ms = period_ms;
    this.#send = send;
  }

  /** Send now if the last one is a period ago; else store it in place of the waiting one. */
  put(value: T): void {
    this.#next = { value };
    if (this.#timer === undefined) this.#flush();
  }

  /** Discard the waiting value. */
  cancel(): void {
    this.#next = null;
  }

  #flush(): void {
    const next = this.#next;
    if (next === null) {
      this.#timer = undefined;
      return;
    }
    this.#next = null;
    this.#send(next.value);
    this.#timer = setTimeout(() => this.#flush(), this.#period_ms);
  }
}
