/** Telemetry subscriptions: one owner per page, renewed while the tab is visible, ended when it is hidden. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { connection, link } from "./link";
import { CHANNELS, watch, watched } from "./telemetry-subscription";

const UID = "b".repeat(32);
let sent: { channels: string[]; owner: string; ttl_s: number }[];
let hidden = false;

beforeEach(() => {
  vi.useFakeTimers();
  sent = [];
  hidden = false;
  vi.spyOn(document, "hidden", "get").mockImplementation(() => hidden);
  link.value = { state: "up", since: 0 };
  connection.value = 1;
  vi.stubGlobal("fetch", async (_: string, init: RequestInit) => {
    const body = JSON.parse(String(init.body));
    sent.push(body);
    const grant = { channels: body.channels, requested_hz: 20, granted_hz: 20, bus_share: 0, note: null };
    return new Response(JSON.stringify(grant));
  });
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const look = (away: boolean) => {
  hidden = away;
  document.dispatchEvent(new Event("visibilitychange"));
};

test("it is sent at once and every four seconds, with a time after which it expires", async () => {
  const end = watch(UID);
  await vi.advanceTimersByTimeAsync(8100);
  expect(sent).toHaveLength(3);
  expect(sent[0]).toMatchObject({ channels: CHANNELS, ttl_s: 10 });
  expect(sent[0]?.owner).toMatch(/^page-\w+$/);
  expect(new Set(sent.map(one => one.owner)).size).toBe(1);
  expect(watched.value?.uid).toBe(UID);
  end();
  expect(sent.at(-1)?.channels).toEqual([]);
  expect(sent.at(-1)?.owner).toBe(sent[0]?.owner);
  await vi.advanceTimersByTimeAsync(9000);
  expect(sent, "nothing after the end").toHaveLength(4);
  expect(watched.value).toBeNull();
});

test("it is not said while the tab is hidden or the link is down, and at once after", async () => {
  const end = watch(UID);
  await vi.advanceTimersByTimeAsync(100);
  look(true);
  await vi.advanceTimersByTimeAsync(9000);
  expect(sent).toHaveLength(1);
  look(false);
  expect(sent).toHaveLength(2);
  link.value = { state: "down", since: 0 };
  await vi.advanceTimersByTimeAsync(9000);
  expect(sent).toHaveLength(2);
  link.value = { state: "up", since: 0 };
  expect(sent).toHaveLength(3);
  end();
  await vi.advanceTimersByTimeAsync(10);
});

test("a response after the end is ignored", async () => {
  const end = watch(UID);
  end();
  await vi.advanceTimersByTimeAsync(100);
  expect(watched.value).toBeNull();
});
