/** Columns for a plot: two clocks on one axis, gaps kept. */
import { describe, expect, test } from "vitest";
import { calmRange, merge } from "./series";

const window = (...samples: [number, number][]) => ({
  t: Float64Array.from(samples.map(one => one[0])),
  v: Float64Array.from(samples.map(one => one[1])),
});

describe("merge", () => {
  test("puts both curves on one axis, in seconds before now", () => {
    const out = merge(window([1, 10], [1.1, 11]), window([1.05, 5]), 2, 1);
    expect(out.x).toEqual([-1, expect.closeTo(-0.95), expect.closeTo(-0.9)]);
    expect(out.angle).toEqual([10, undefined, 11]);
    expect(out.command).toEqual([undefined, 5, undefined]);
  });

  test("breaks a curve where samples are missing, and only that curve", () => {
    const out = merge(window([1, 10], [5, 11]), window([1, 5], [2, 5], [3, 5], [4, 5], [5, 5]), 5, 1.5);
    expect(out.angle).toEqual([10, null, null, null, null, 11]);
    expect(out.command).toEqual([5, 5, 5, 5, undefined, 5]);
  });

  test("a sample that is a gap is drawn as one", () => {
    expect(merge(window([1, 10], [1.1, Number.NaN]), window(), 2, 1).angle).toEqual([10, null]);
  });
});

describe("calmRange", () => {
  const of = (...values: number[]) => ({ x: values, angle: values, command: [] });
  test("is round, and at least 20° high", () => {
    expect(calmRange(of(1, 2), null)).toEqual([-10, 10]);
    expect(calmRange(of(-33, 47), null)).toEqual([-40, 50]);
  });
  test("stays while the curve stays inside", () => {
    expect(calmRange(of(-30, 30), [-40, 50])).toEqual([-40, 50]);
    expect(calmRange(of(0, 55), [-40, 50])).toEqual([-10, 60]);
  });
  test("keeps what it had while there is nothing", () => {
    expect(calmRange(of(), [-40, 50])).toEqual([-40, 50]);
  });
});
