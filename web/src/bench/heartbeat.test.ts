/** The heart-beat: twice a second, also behind a heap of messages, and none from a page that hangs. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";

const received = vi.hoisted(() => ({ message: (): void => undefined }));
vi.mock("./link", () => ({
  live: { send: vi.fn(() => true) },
  onAnyMessage: (act: () => void) => {
    received.message = act;
  },
}));
const { BEAT_MS, startBeat, stopBeat } = await import("./heartbeat");
const { live } = await import("./link");
const { TTL_S } = await import("./motion");

const send = vi.mocked(live.send);

beforeEach(() => {
  vi.useFakeTimers();
  send.mockClear();
});

afterEach(() => {
  stopBeat();
  vi.useRealTimers();
});

/** Time passes while the page is blocked: none of its timers run. */
function hang(ms: number): void {
  const frozen = performance.now() + ms;
  vi.spyOn(performance, "now").mockReturnValue(frozen);
}

test("a lease is said at once, and several times in each third of its term", () => {
  startBeat("L");
  expect(send.mock.calls).toEqual([[{ type: "heartbeat", lease: "L" }]]);
  vi.advanceTimersByTime(TTL_S * 1000);
  expect(send).toHaveBeenCalledTimes(1 + (TTL_S * 1000) / BEAT_MS);
  expect(BEAT_MS).toBeLessThanOrEqual((TTL_S * 1000) / 6);
});

test("a beat that is due does not wait behind a heap of messages, and a heap of messages is no heap of beats", () => {
  startBeat("L");
  send.mockClear();
  hang(BEAT_MS);
  for (let i = 0; i < 100; i++) received.message();
  expect(send).toHaveBeenCalledTimes(1);
});

test("a page that hangs says nothing, and when it goes on it says so once, not what it missed", () => {
  startBeat("L");
  send.mockClear();
  hang(TTL_S * 1000 + 500);
  expect(send).not.toHaveBeenCalled();
  received.message();
  expect(send).toHaveBeenCalledTimes(1);
});

test("a released lease is not reported, whatever is received", () => {
  startBeat("L");
  stopBeat();
  send.mockClear();
  received.message();
  vi.advanceTimersByTime(10_000);
  expect(send).not.toHaveBeenCalled();
});

test("of two leases only the later is kept", () => {
  startBeat("old");
  startBeat("new");
  send.mockClear();
  vi.advanceTimersByTime(BEAT_MS);
  expect(send.mock.calls).toEqual([[{ type: "heartbeat", lease: "new" }]]);
});
