/** Gaps, and what is read at a cursor: samples that were taken, and nothing between them where none was. */
import { describe, expect, test } from "vitest";
import { stepFrom, valueAtTime } from "./reading";
import { isGap, isWrap } from "./series";

const of = (...times: number[]) => ({
  t: Float64Array.from(times),
  v: Float64Array.from(times.map(t => t * 10)),
});
const every = (from: number, to: number, step: number) =>
  Array.from({ length: Math.round((to - from) / step) }, (_, i) => from + i * step);

describe("a gap", () => {
  test("is where samples lie three times as far apart as their neighbours", () => {
    const one = of(...every(0, 1, 0.05), ...every(1.6, 2, 0.05));
    expect(one.t.findIndex((_, i) => i > 0 && isGap(one.t, i))).toBe(20);
    expect([...one.t].filter((_, i) => i > 0 && isGap(one.t, i))).toHaveLength(1);
  });

  test("a response a third of a second late is no gap, nor are rare samples", () => {
    const late = of(...every(0, 1, 0.05), ...every(1.3, 2, 0.05));
    expect([...late.t].some((_, i) => i > 0 && isGap(late.t, i))).toBe(false);
    const seldom = of(0, 5, 10.2, 15.1, 20);
    expect([...seldom.t].some((_, i) => i > 0 && isGap(seldom.t, i))).toBe(false);
  });

  test("does not depend on what was requested for: a channel requested for faster from now on has no gaps before", () => {
    const one = of(0, 2, 4, ...every(6, 7, 0.05));
    expect([...one.t].some((_, i) => i > 1 && isGap(one.t, i) && (one.t[i] ?? 0) < 6)).toBe(false);
  });
});

describe("valueAt", () => {
  const one = of(...every(0, 1, 0.1), 3, 3.1, 3.2);
  test("is the nearest sample", () => {
    expect(valueAtTime(one, 0.34)).toBeCloseTo(3);
    expect(valueAtTime(one, 3.08)).toBeCloseTo(31);
  });
  test("is null in a gap, far from the ends, and without samples", () => {
    expect(valueAtTime(one, 2)).toBeNull();
    expect(valueAtTime(one, 9)).toBeNull();
    expect(valueAtTime({ t: Float64Array.of(1, 2), v: Float64Array.of(1, Number.NaN) }, 2)).toBeNull();
  });
});

test("a cursor steps from sample to sample and stops at the ends", () => {
  const one = of(1, 2, 4);
  expect(stepFrom(one, 1.1, 1)).toBe(2);
  expect(stepFrom(one, 2, 10)).toBe(4);
  expect(stepFrom(one, 2, -10)).toBe(1);
  expect(stepFrom(of(), 7, 1)).toBe(7);
});

test("an angle that goes through ±180° is a wrap; a command may step over most of the circle", () => {
  expect(isWrap(179.8, -179.9)).toBe(true);
  expect(isWrap(-170, 175, true)).toBe(true);
  expect(isWrap(-120, 120, true)).toBe(false);
  expect(isWrap(-60, 60)).toBe(false);
  expect(isWrap(Number.NaN, 90)).toBe(false);
});
