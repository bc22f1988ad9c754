/** The rule for values that come faster than they may leave: the newest wins, one a period. */

export class Newest<T> {
  #period_ms: number;
  #send: (value: T) => void;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #next: { value: T } | null = null;

  constructor(period_ms: number, send: (value: T) => void) {
    this.#period_ms = period_ms;
    this.#send = send;
  }

  /** Sends at once if the last one is a period ago; else keeps this one, forgetting what waited before it. */
  put(value: T): void {
    this.#next = { value };
    if (this.#timer === undefined) this.#flush();
  }

  /** Forgets what waits. */
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
