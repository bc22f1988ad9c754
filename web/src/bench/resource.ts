/** Something asked of the server, once or again and again: its newest answer, why there is none, and when it was told. */

import { type Signal, signal } from "@preact/signals";
import { problemOf } from "../api/client";
import { monotonic } from "./clock";
import { problemText } from "./facts";
import { type Poll, poll } from "./poll";

export class Resource<T> {
  /** Null until it is there; kept while it cannot be read again. */
  readonly value: Signal<T | null> = signal(null);
  /** Why the last question was not answered, in words. */
  readonly problem: Signal<string | null> = signal(null);
  /** Our monotonic time of the last answer; null before the first. */
  readonly readAt: Signal<number | null> = signal(null);
  readonly #look: () => Promise<T>;
  #round = 0;

  constructor(look: () => Promise<T>) {
    this.#look = look;
  }

  /** Asks, for something else when told. The newest question wins. */
  readonly load = async (look = this.#look): Promise<void> => {
    const round = ++this.#round;
    try {
      const found = await look();
      if (round !== this.#round) return;
      this.value.value = found;
      this.readAt.value = monotonic();
      this.problem.value = null;
    } catch (error) {
      if (round === this.#round) this.problem.value = problemText(problemOf(error));
    }
  };

  /** Asks at once and then `every_ms` after each answer, while somebody can see it. */
  watch(every_ms: number): Poll {
    return poll(every_ms, () => this.load());
  }
}
