/** Spans: following, standing still, enlarging, cursors, and the way back. */
import { beforeEach, describe, expect, test } from "vitest";
import { TimeSpan } from "./span";

let now = 100;
const live = () => new TimeSpan(() => now);

beforeEach(() => {
  now = 100;
});

describe("a span that goes on", () => {
  test("follows the server's clock, and shows nothing before that is known", () => {
    const span = live();
    expect(span.shown()).toEqual({ from: 90, to: 100, zero: 100 });
    now = 103;
    expect(span.shown()).toEqual({ from: 93, to: 103, zero: 103 });
    expect(new TimeSpan(() => Number.NaN).shown()).toBeNull();
  });

  test("stands still when paused, and follows again without the cursors", () => {
    const span = live();
    span.pause();
    now = 120;
    expect(span.shown()).toEqual({ from: 90, to: 100, zero: 100 });
    span.place(95);
    expect(span.away).toBe(true);
    span.follow();
    expect(span.away).toBe(false);
    expect(span.cursors.value).toEqual([null, null]);
    expect(span.shown()?.to).toBe(120);
  });

  test("enlarges a part whichever way it was dragged, and keeps the zero of its axis", () => {
    const span = live();
    span.zoom(97, 94);
    expect(span.shown()).toEqual({ from: 94, to: 97, zero: 100 });
    now = 110;
    span.zoom(95, 96);
    expect(span.shown()).toEqual({ from: 95, to: 96, zero: 100 });
  });

  test("another window means following", () => {
    const span = live();
    span.zoom(94, 97);
    span.choose(30);
    expect(span.shown()).toEqual({ from: 70, to: 100, zero: 100 });
  });
});

describe("cursors", () => {
  test("are placed one after the other; the nearer one moves from then on; time stands still", () => {
    const span = live();
    span.place(92);
    now = 105;
    expect(span.shown()?.to).toBe(100);
    span.place(98);
    expect(span.cursors.value).toEqual([92, 98]);
    span.place(97);
    expect(span.cursors.value).toEqual([92, 97]);
    span.place(91);
    expect(span.cursors.value).toEqual([91, 97]);
  });

  test("stay inside what is shown, and enlarge what is between them", () => {
    const span = live();
    span.flipCursors();
    span.move(0, -5);
    span.move(1, 95);
    expect(span.cursors.value).toEqual([90, 95]);
    span.zoomToCursors();
    expect(span.shown()).toMatchObject({ from: 90, to: 95 });
    span.flipCursors();
    expect(span.cursors.value).toEqual([null, null]);
  });
});

test("a recording has an end: the way back shows all of it", () => {
  const span = new TimeSpan(() => Number.NaN, { from: 0, to: 50, zero: 0 });
  expect(span.goesOn).toBe(false);
  expect(span.away).toBe(false);
  span.zoom(10, 20);
  expect(span.away).toBe(true);
  span.follow();
  expect(span.shown()).toEqual({ from: 0, to: 50, zero: 0 });
});
