/** Lanes: a unit each, a calm range, round ticks. */
import { describe, expect, test } from "vitest";
import { calmRange, lanesOf, laneTicksOf } from "./lane";

const curve = (channel: string, unit: string) => ({
  uid: "a",
  channel,
  name: channel,
  colour: "ink" as const,
  dashed: false,
  unit,
  decimals: 1,
});

test("curves of a unit share a lane, in the order in which units come", () => {
  const lanes = lanesOf([curve("angle", "°"), curve("supply", "V"), curve("command", "°")]);
  expect(lanes.map(one => [one.unit, one.curves.map(each => each.channel)])).toEqual([
    ["°", ["angle", "command"]],
    ["V", ["supply"]],
  ]);
});

describe("calmRange", () => {
  test("is round, and at least as high as noise of its unit is small", () => {
    expect(calmRange([1, 2], "°", null)).toEqual([-10, 10]);
    expect(calmRange([-33, 47], "°", null)).toEqual([-40, 50]);
    expect(calmRange([7.38, 7.42], "V", null)).toEqual([6, 9]);
  });
  test("stays while the curve stays inside", () => {
    expect(calmRange([-30, 30], "°", [-40, 50])).toEqual([-40, 50]);
    expect(calmRange([0, 55], "°", [-40, 50])).toEqual([-10, 60]);
  });
  test("keeps what it had while there is nothing", () => {
    expect(calmRange(null, "°", [-40, 50])).toEqual([-40, 50]);
  });
  test("holds every value of turns that were counted", () => {
    const [low, high] = calmRange([-7200, 90], "°", null);
    expect(low).toBeLessThanOrEqual(-7200);
    expect(high).toBeGreaterThanOrEqual(90);
  });
});

test("ticks are round, inside, and no more than there is room for", () => {
  expect(laneTicksOf(-40, 50, 6)).toEqual([-40, -20, 0, 20, 40]);
  expect(laneTicksOf(6, 8, 4)).toEqual([6, 6.5, 7, 7.5, 8]);
  expect(laneTicksOf(-10, 10, 2).length).toBeLessThanOrEqual(3);
});
