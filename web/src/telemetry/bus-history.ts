/** History of the bus counters: load over the last minutes, and which counters rise since when. */
import type { Bus } from "../api/types";
import { Ring } from "./ring";

/** One sample per second for ten minutes. */
const CAPACITY = 600;

/** Time without a rise after which a counter no longer counts as rising. */
export const CALM_S = 30;

const WATCHED = ["errors", "bus_offs", "unacknowledged", "rx_dropped", "reopened"] as const;
export type BusCounter = (typeof WATCHED)[number];

interface Rise {
  /** UTC of the first step of this rise. */
  since: number;
  /** Monotonic time of the last step. */
  last: number;
}

export class BusHistory {
  /** Load in % over monotonic time; a gap without a bus. */
  readonly load = new Ring(CAPACITY);
  #rises = new Map<BusCounter, Rise>();
  #before: Bus | null = null;

  /** Add the bus state received at monotonic time `at`, which is `utc` seconds since 1970. */
  note(bus: Bus, at: number, utc: number): void {
    const before = this.#before;
    this.#before = bus;
    this.load.push(at, bus.load_pct ?? Number.NaN);
    // Another bus, or the same one reconnected manually: its counters restart.
    if (!before || before.address !== bus.address || bus.rx_frames < before.rx_frames) {
      this.#rises.clear();
      return;
    }
    for (const key of WATCHED) {
      if (bus[key] <= before[key]) continue;
      const rise = this.#rises.get(key);
      const goesOn = rise !== undefined && at - rise.last < CALM_S;
      this.#rises.set(key, { since: goesOn ? rise.since : utc, last: at });
    }
  }

  /** UTC since when a counter rises; null if it does not. */
  risingSince(key: BusCounter, at: number): number | null {
    const rise = this.#rises.get(key);
    return rise && at - rise.last < CALM_S ? rise.since : null;
  }
}
