/** The bus over time: load with its gaps, and counters that rise, go on rising and calm down. */
import { beforeEach, describe, expect, test } from "vitest";
import type { Bus } from "../api/types";
import { BusHistory, CALM_S } from "./bus-history";

const bus = (part: Partial<Bus>): Bus =>
  ({
    state: "active",
    address: "socketcan:can0",
    load_pct: 10,
    rx_frames: 100,
    errors: 0,
    bus_offs: 0,
    unacknowledged: 0,
    rx_dropped: 0,
    reopened: 0,
    ...part,
  }) as Bus;

let history: BusHistory;

beforeEach(() => {
  history = new BusHistory();
});

describe("BusHistory", () => {
  test("keeps the load, and a gap while there is none", () => {
    history.note(bus({ load_pct: 12 }), 1, 1001);
    history.note(bus({ load_pct: null }), 2, 1002);
    history.note(bus({ load_pct: 14 }), 3, 1003);
    expect([...history.load.since(0).v]).toEqual([12, Number.NaN, 14]);
  });

  test("errors that were there when the page was opened do not rise", () => {
    history.note(bus({ errors: 31 }), 1, 1001);
    history.note(bus({ errors: 31 }), 2, 1002);
    expect(history.risingSince("errors", 2)).toBeNull();
  });

  test("a counter rises since its first step for as long as it goes on, and then is calm", () => {
    history.note(bus({ errors: 0 }), 1, 1001);
    history.note(bus({ errors: 2 }), 5, 1005);
    history.note(bus({ errors: 3 }), 5 + CALM_S - 1, 1034);
    expect(history.risingSince("errors", 40)).toBe(1005);
    expect(history.risingSince("bus_offs", 40)).toBeNull();
    expect(history.risingSince("errors", 5 + CALM_S - 1 + CALM_S)).toBeNull();
    history.note(bus({ errors: 4 }), 100, 1100);
    expect(history.risingSince("errors", 100)).toBe(1100);
  });

  test("another bus or restarted counters end every rise", () => {
    history.note(bus({ errors: 0 }), 1, 1001);
    history.note(bus({ errors: 5 }), 2, 1002);
    history.note(bus({ errors: 9, address: "socketcan:can1" }), 3, 1003);
    expect(history.risingSince("errors", 3)).toBeNull();
    history.note(bus({ errors: 10, address: "socketcan:can1" }), 4, 1004);
    history.note(bus({ errors: 11, address: "socketcan:can1", rx_frames: 0 }), 5, 1005);
    expect(history.risingSince("errors", 5)).toBeNull();
  });
});
