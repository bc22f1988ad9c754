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

describe("a ring that grows", () => {
  const growing = () => new Ring(4, { most: 16, seconds: 10 });
  test("holds the seconds it is for, and not more than it may", () => {
    const ring = growing();
    for (let i = 0; i < 100; i++) ring.push(i, i);
    expect(ring.capacity).toBe(16);
    expect(ring.lastTime - ring.firstTime).toBeGreaterThanOrEqual(10);
    const fast = growing();
    for (let i = 0; i < 1000; i++) fast.push(i / 100, i);
    expect(fast.capacity).toBe(16);
    expect([...fast.all().t]).toEqual(Array.from({ length: 16 }, (_, i) => (984 + i) / 100));
  });

  test("takes a past before its oldest sample, of which what is newer stays out", () => {
    const ring = growing();
    ring.push(5, 50);
    ring.push(6, 60);
    ring.prepend([1, 2, 3, 5.5], [10, Number.NaN, 30, 55]);
    expect([...ring.all().t]).toEqual([1, 2, 3, 5, 6]);
    expect([...ring.all().v]).toEqual([10, Number.NaN, 30, 50, 60]);
    ring.push(7, 70);
    expect(ring.lastValue).toBe(70);
    ring.prepend(
      Array.from({ length: 40 }, (_, i) => i / 50),
      new Array(40).fill(1),
    );
    expect(ring.length).toBe(16);
    expect(ring.lastTime).toBe(7);
  });

  test("takes a past while it is empty", () => {
    const ring = growing();
    ring.prepend([1, 2], [1, 2]);
    ring.push(3, 3);
    expect([...ring.all().t]).toEqual([1, 2, 3]);
  });
});
