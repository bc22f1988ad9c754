/** Traces: gaps kept, edges reached, thinned without losing a peak. */
import { describe, expect, test } from "vitest";
import { extent, firstAt, inSight, nearestSample, samples, thin } from "./trace";

const ramp = (n: number) =>
  samples(
    Array.from({ length: n }, (_, i) => i),
    Array.from({ length: n }, (_, i) => i % 7),
  );

describe("samples", () => {
  test("are moved to their own zero, and a null is a gap", () => {
    const one = samples([10, 11, 12], [5, null, 7], 10, 5);
    expect([...one.t]).toEqual([0, 1, 2]);
    expect([...one.v]).toEqual([0, Number.NaN, 2]);
  });
});

describe("what is in sight", () => {
  test("reaches one sample over each edge", () => {
    const { t } = ramp(10);
    expect(inSight(t, 3.5, 6.5)).toEqual([3, 8]);
    expect(inSight(t, -5, 50)).toEqual([0, 10]);
    expect(firstAt(t, 4)).toBe(4);
    expect(firstAt(t, 40)).toBe(10);
  });

  test("is measured without its gaps", () => {
    const one = samples([0, 1, 2, 3], [1, null, 9, 4]);
    expect(extent([one], 0, 3)).toEqual([1, 9]);
    expect(extent([samples([], [])], 0, 3)).toBeNull();
  });
});

describe("thin", () => {
  test("keeps all where there is room", () => {
    expect([...thin(ramp(8), 2, 6, 10)]).toEqual([2, 3, 4, 5]);
  });

  test("keeps a peak of one sample, and order", () => {
    const one = ramp(10_000);
    one.v[6543] = 99;
    const kept = [...thin(one, 0, 10_000, 50)];
    expect(kept).toContain(6543);
    expect(kept.length).toBeLessThanOrEqual(4 * 50 + 4);
    expect(kept).toEqual([...kept].sort((a, b) => a - b));
    expect(kept[0]).toBe(0);
    expect(kept.at(-1)).toBe(9999);
  });

  test("never bridges a gap", () => {
    const one = ramp(10_000);
    one.v[5000] = Number.NaN;
    expect([...thin(one, 0, 10_000, 50)]).toContain(5000);
  });
});

test("nearest takes the nearer of two samples", () => {
  const one = samples([0, 1, 2], [0, 0, 0]);
  expect(nearestSample(one, 0.4)).toBe(0);
  expect(nearestSample(one, 0.6)).toBe(1);
  expect(nearestSample(one, 9)).toBe(2);
  expect(nearestSample(samples([], []), 1)).toBe(-1);
});
