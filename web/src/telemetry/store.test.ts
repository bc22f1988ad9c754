/** The store: ages on our clock from times on the server's; how much is kept. */
import { describe, expect, test } from "vitest";
import { KEPT_S, TelemetryStore } from "./store";

describe("TelemetryStore", () => {
  test("the age of the newest sample follows from the least delayed batch", () => {
    const store = new TelemetryStore();
    store.push("a", "angle", [100], [1], 5.2); // 0.2 s under way
    store.push("a", "angle", [101], [2], 6.0); // not delayed: the clocks differ by 95 s
    expect(store.latest("a", "angle", 6.0)).toEqual({ value: 2, age: expect.closeTo(0, 3) });
    expect(store.latest("a", "angle", 8.5)?.age).toBeCloseTo(2.5, 2);
  });

  test("a late batch does not make old samples look fresh", () => {
    const store = new TelemetryStore();
    store.push("a", "angle", [100], [1], 5);
    store.push("a", "angle", [101], [2], 9);
    expect(store.latest("a", "angle", 9)?.age).toBeCloseTo(3, 2);
  });

  test("has no value where the newest sample is a gap, nor where nothing came", () => {
    const store = new TelemetryStore();
    store.push("a", "angle", [1, 2], [7, null], 1);
    expect(store.latest("a", "angle", 1)).toBeNull();
    expect(store.latest("a", "speed", 1)).toBeNull();
    expect(store.latest("b", "angle", 1)).toBeNull();
  });

  test("forgets everything when the server's clock may be another", () => {
    const store = new TelemetryStore();
    store.push("a", "angle", [1], [7], 1);
    store.clear();
    expect(store.latest("a", "angle", 1)).toBeNull();
    expect(store.serverTime(1)).toBeNaN();
  });

  test("an hour of 50 Hz takes no more room than its longest window", () => {
    const store = new TelemetryStore();
    let most = 0;
    for (let i = 0; i < 50 * 3600; i++) {
      store.push("a", "angle", [i / 50], [i % 90], i / 50);
      most = Math.max(most, store.ring("a", "angle").capacity);
    }
    const ring = store.ring("a", "angle");
    expect(ring.capacity).toBe(most);
    expect(most).toBeLessThanOrEqual(32_768);
    expect(ring.lastTime - ring.firstTime).toBeGreaterThanOrEqual(KEPT_S);
  });
});
