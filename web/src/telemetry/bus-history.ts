/** What the counters of the bus did: its load over the last minutes, and which of them rise, since when. */
import type { Bus } from "../api/types";
import { Ring } from "./ring";

/** One a second for ten minutes. */
const CAPACITY = 600;

/** A counter that has not risen for so long is calm again. */
export const CALM_S = 30;

const WATCHED = ["errors", "bus_offs", "unacknowledged", "rx_dropped", "reopened"] as const;
export type BusCounter = (typeof WATCHED)[number];

interface Rise {
  /** UTC of the first step of this rise. */
  since: number;
  /** Our monotonic time of the last step. */
  last: number;
}

export class BusHistory {
  /** Load in %, by our monotonic clock; a gap while there is no bus. */
  readonly load = new Ring(CAPACITY);
  #rises = new Map<BusCounter, Rise>();
  #before: Bus | null = null;

  /** Takes the bus as told at our monotonic time `at`, which is `utc` seconds since 1970. */
  note(bus: Bus, at: number, utc: number): void {
    const before = this.#before;
    this.#before = bus;
    this.load.push(at, bus.load_pct ?? Number.NaN);
    // Another bus, or the same one opened anew by hand: its counters start again.
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

  /** Since when a counter rises, in UTC; null while it is calm. */
  risingSince(key: BusCounter, at: number): number | null {
    const rise = this.#rises.get(key);
    return rise && at - rise.last < CALM_S ? rise.since : null;
  }
}
