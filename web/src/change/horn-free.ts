/** Whether the horns turned by a restart can turn freely: confirmed only here. */
import { computed, signal } from "@preact/signals";

interface Restarting {
  uid: string;
  /** Movement of the horn; null or without `moves` if unknown. */
  restart?: { moves: boolean } | null | undefined;
}

export class HornFree {
  readonly #confirmed = signal<string | null>(null);
  readonly #about;
  /** Number of horns that may turn: all except those known to stay. */
  readonly #moving;

  constructor(restarts: () => readonly Restarting[]) {
    this.#moving = computed(() => restarts().filter(one => one.restart?.moves !== false));
    this.#about = computed(() => this.#moving.value.map(one => one.uid).join(" "));
  }

  get count(): number {
    return this.#moving.value.length;
  }

  /** True if the change may start: nothing turns, or the user has confirmed exactly these horns. */
  get agreed(): boolean {
    return this.count === 0 || this.#confirmed.value === this.#about.value;
  }

  say(free: boolean): void {
    this.#confirmed.value = free ? this.#about.value : null;
  }
}
