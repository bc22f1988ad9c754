/** A value requested from the server, once or by polling: last response, error and time. */

import { type Signal, signal } from "@preact/signals";
import { problemOf } from "../api/client";
import { monotonic } from "./clock";
import { problemText } from "./facts";
import { type Poll, poll } from "./poll";

export class Resource<T> {
  /** Null until loaded; kept when a reload fails. */
  readonly value: Signal<T | null> = signal(null);
  /** Why the last request failed, in words. */
  readonly problem: Signal<string | null> = signal(null);
  /** Time of the last response, monotonic; null before the first. */
  readonly readAt: Signal<number | null> = signal(null);
  readonly #look: () => Promise<T>;
  #round = 0;

  constructor(look: () => Promise<T>) {
    this.#look = look;
  }

  /** Request, optionally another item. The newest request wins. */
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

  /** Request now and then `every_ms` after each response, while visible. */
  watch(every_ms: number): Poll {
    return poll(every_ms, () => this.load());
  }
}

/** A resource that every page shows in part: polled often while a page shows all of it, otherwise now and then. */
export class CommonResource<T> extends Resource<T> {
  #pages = 0;

  /** Whether a page polls it often. */
  get often(): boolean {
    return this.#pages > 0;
  }

  /** Poll while no page does. */
  start(every_ms: number): void {
    poll(every_ms, async () => {
      if (!this.often) await this.load();
    });
  }

  override watch(every_ms: number): Poll {
    this.#pages += 1;
    const { now, end } = super.watch(every_ms);
    return {
      now,
      end: () => {
        this.#pages -= 1;
        end();
      },
    };
  }
}
