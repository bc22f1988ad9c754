/** Rings: order, wrap-round, contiguous windows, gaps. */
import { describe, expect, test } from "vitest";
import { Ring } from "./ring";

const filled = (capacity: number, count: number) => {
  const ring = new Ring(capacity);
  for (let i = 0; i < count; i++) ring.push(i, i * 10);
  return ring;
};

describe("Ring", () => {
  test("is empty at first", () => {
    const ring = new Ring(4);
    expect(ring.length).toBe(0);
    expect(ring.lastTime).toBeNaN();
    expect(ring.since(0).t).toHaveLength(0);
  });

  test("keeps the newest when it is full, oldest first, in one piece", () => {
    for (const count of [1, 3, 4, 5, 7, 8, 9, 31]) {
      const ring = filled(4, count);
      const first = Math.max(0, count - 4);
      const times = Array.from({ length: Math.min(4, count) }, (_, i) => first + i);
      const window = ring.since(Number.NEGATIVE_INFINITY);
      expect([...window.t]).toEqual(times);
      expect([...window.v]).toEqual(times.map(t => t * 10));
      expect(ring.lastTime).toBe(count - 1);
      expect(ring.lastValue).toBe((count - 1) * 10);
    }
  });

  test("a window takes the sample before its edge along, so a line enters there", () => {
    expect([...filled(8, 6).since(2.5).t]).toEqual([2, 3, 4, 5]);
    expect([...filled(8, 6).since(0).t]).toEqual([0, 1, 2, 3, 4, 5]);
    expect([...filled(8, 6).since(99).t]).toEqual([5]);
  });

  test("time only goes forward", () => {
    const ring = filled(4, 3);
    expect(ring.push(2, 99)).toBe(false);
    expect(ring.push(1, 99)).toBe(false);
    expect([...ring.since(0).t]).toEqual([0, 1, 2]);
  });

  test("a gap stays a gap", () => {
    const ring = new Ring(4);
    ring.push(1, 5);
    ring.push(2, Number.NaN);
    expect(ring.lastValue).toBeNaN();
    expect([...ring.since(0).v]).toEqual([5, Number.NaN]);
  });

  test("room for no sample is a mistake", () => {
    expect(() => new Ring(0)).toThrow(RangeError);
  });
});
