/** Drags: the newest wins, at most one a period. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Newest } from "./throttle";

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

test("sends the first at once, then the newest a period later, never more", () => {
  const sent: number[] = [];
  const newest = new Newest<number>(33, value => sent.push(value));
  for (let i = 1; i <= 5; i++) newest.put(i);
  expect(sent).toEqual([1]);
  vi.advanceTimersByTime(33);
  expect(sent).toEqual([1, 5]);
  vi.advanceTimersByTime(500);
  expect(sent).toEqual([1, 5]);
  newest.put(6);
  expect(sent).toEqual([1, 5, 6]);
});

test("what waits can be forgotten: a stop is the last word", () => {
  const sent: number[] = [];
  const newest = new Newest<number>(33, value => sent.push(value));
  newest.put(1);
  newest.put(2);
  newest.cancel();
  vi.advanceTimersByTime(500);
  expect(sent).toEqual([1]);
});

test("a second of drag at 200 Hz becomes about thirty commands", () => {
  const sent: number[] = [];
  const newest = new Newest<number>(1000 / 30, value => sent.push(value));
  for (let i = 0; i < 200; i++) {
    newest.put(i);
    vi.advanceTimersByTime(5);
  }
  expect(sent.length).toBeGreaterThan(25);
  expect(sent.length).toBeLessThanOrEqual(31);
});
