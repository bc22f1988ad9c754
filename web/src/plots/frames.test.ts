/** Draws at their rates, without animation frames between them. */
import { afterEach, expect, test, vi } from "vitest";

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("an animation frame is requested only when a draw is due", async () => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "requestAnimationFrame", "performance"] });
  vi.stubGlobal("IntersectionObserver", undefined);
  vi.resetModules();
  const { everyFrame } = await import("./frames");
  const requested = vi.spyOn(globalThis, "requestAnimationFrame");
  const slow = vi.fn();
  const forgetSlow = everyFrame(document.createElement("canvas"), 4, slow);
  vi.advanceTimersByTime(2000);
  expect(slow.mock.calls.length).toBeGreaterThanOrEqual(7);
  expect(requested.mock.calls.length).toBeLessThanOrEqual(slow.mock.calls.length + 2);

  const fast = vi.fn();
  const forgetFast = everyFrame(document.createElement("canvas"), 60, fast);
  vi.advanceTimersByTime(1000);
  expect(fast.mock.calls.length, "it does not wait for the slow one").toBeGreaterThanOrEqual(55);

  forgetFast();
  forgetSlow();
  vi.advanceTimersByTime(1000);
  requested.mockClear();
  vi.advanceTimersByTime(1000);
  expect(requested).not.toHaveBeenCalled();
});

test("a frame in which values all over the page change is left to them, but never two in a row", async () => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "requestAnimationFrame", "performance"] });
  vi.stubGlobal("IntersectionObserver", undefined);
  vi.resetModules();
  const { everyFrame } = await import("./frames");
  const { refreshed } = await import("../bench/clock");
  const drawn = vi.fn();
  const forget = everyFrame(document.createElement("canvas"), 60, drawn);
  vi.advanceTimersByTime(100);
  drawn.mockClear();
  refreshed();
  vi.advanceTimersToNextTimer();
  expect(drawn).not.toHaveBeenCalled();
  refreshed();
  vi.advanceTimersToNextTimer();
  expect(drawn).toHaveBeenCalledTimes(1);
  forget();
});
