/** Whether horns that a restart turns can do so freely: asked here alone. */
import { computed, signal } from "@preact/signals";

interface Restarting {
  uid: string;
  /** What the horn does; null or without `moves` where that is not known. */
  restart?: { moves: boolean } | null | undefined;
}

export class HornFree {
  readonly #said = signal<string | null>(null);
  readonly #about;
  /** How many horns may turn: all but those of which it is known that they do not. */
  readonly #moving;

  constructor(restarts: () => readonly Restarting[]) {
    this.#moving = computed(() => restarts().filter(one => one.restart?.moves !== false));
    this.#about = computed(() => this.#moving.value.map(one => one.uid).join(" "));
  }

  get count(): number {
    return this.#moving.value.length;
  }

  /** Whether the change may begin: nothing turns, or somebody said that just these can. */
  get agreed(): boolean {
    return this.count === 0 || this.#said.value === this.#about.value;
  }

  say(free: boolean): void {
    this.#said.value = free ? this.#about.value : null;
  }
}
