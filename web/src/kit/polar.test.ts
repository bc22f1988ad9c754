/** Dial geometry: 0° up, plus clockwise. */
import { describe, expect, test } from "vitest";
import { angleAt, arc, polar, unwrap, wholeTurns } from "./polar";

describe("polar", () => {
  test.each([
    [0, 0, -10],
    [90, 10, 0],
    [180, 0, 10],
    [-90, -10, 0],
  ])("%d° is at %d, %d and back", (degrees, x, y) => {
    const at = polar(10, degrees);
    expect(at.x).toBeCloseTo(x);
    expect(at.y).toBeCloseTo(y);
    expect(Math.abs(angleAt(x, y))).toBeCloseTo(Math.abs(degrees));
  });

  test("a drag goes on past ±180°", () => {
    expect(unwrap(-170, 175)).toBe(190);
    expect(unwrap(170, -175)).toBe(-190);
    expect(unwrap(10, 725)).toBe(730);
    expect(unwrap(20, 15)).toBe(20);
  });

  test("turns are counted beyond ±180°", () => {
    expect([0, 179.9, -180, 270, -270, 720].map(wholeTurns)).toEqual([0, 0, 0, 1, -1, 2]);
  });

  test("limits a turn apart close the ring", () => {
    expect(arc(10, -180, 180).match(/A/g)).toHaveLength(2);
    expect(arc(10, -60, 60).match(/A/g)).toHaveLength(1);
  });
});
