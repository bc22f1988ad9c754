/** Faults: which are now, in what order they stand, and which still want to be acknowledged. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Fault } from "../api/types";
import { acknowledge, faultsOf, readFaults, troubleOf, unseen } from "./faults";

const A = "a".repeat(32);
const B = "b".repeat(32);
const plain: Fault = {
  level: "warning",
  group: "hardware",
  bit: 0,
  key: "one",
  label: "One",
  advice: "Do.",
  active: true,
  stale: false,
  latched: false,
  past_event: false,
  first_seen: 1,
  last_seen: 1,
  count: 1,
  acknowledged_at: null,
  acknowledged_by: null,
};
let lists: Record<string, Fault[]>;
let sent: string[];
let broken = false;
let unknown = "";

const gone = { code: "unknown_servo", status: 404, detail: "no such servo" };

const recordsOf = (uid: string) =>
  uid === unknown ? { faults: [], problem: gone } : { faults: lists[uid], problem: null };

/** Reads the faults of these servos, as readers that are shown together want them. */
async function read(...uids: string[]): Promise<void> {
  for (const uid of uids) readFaults(uid);
  await vi.runAllTimersAsync();
}

beforeEach(() => {
  vi.useFakeTimers();
  sent = [];
  broken = false;
  unknown = "";
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    sent.push(`${init.method} ${url.replace("/api/v1/", "")}`);
    if (broken) return new Response("{}", { status: 500 });
    const uids = new URL(url, "http://x").searchParams.get("uids")?.split(",") ?? [];
    return new Response(
      JSON.stringify({ servos: Object.fromEntries(uids.map(uid => [uid, recordsOf(uid)])) }),
    );
  });
});

afterEach(async () => {
  await vi.runAllTimersAsync();
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const keys = (lines: { key: string }[]) => lines.map(one => one.key);

test("what is now stands before what was, worst first, and unseen before seen", async () => {
  lists = {
    [A]: [
      { ...plain, key: "seen", acknowledged_at: 3, acknowledged_by: "page-1000", last_seen: 9 },
      { ...plain, key: "unseen" },
      { ...plain, key: "gone", active: false },
    ],
    [B]: [
      { ...plain, key: "silent", active: false, stale: true, level: "failure" },
      { ...plain, key: "notice", level: "notification" },
      { ...plain, key: "broken", level: "failure" },
      { ...plain, key: "newer", last_seen: 5 },
    ],
  };
  await read(A, B);
  expect(sent).toEqual([`GET faults?uids=${A},${B}`]);
  const { now, past } = faultsOf([A, B]);
  expect(keys(now)).toEqual(["broken", "silent", "newer", "unseen", "seen", "notice"]);
  expect(keys(past)).toEqual(["gone"]);
  expect(keys(faultsOf([A]).now)).toEqual(["unseen", "seen"]);
});

test("notifications and acknowledged faults need no acknowledgement", () => {
  expect(unseen(plain)).toBe(true);
  expect(unseen({ ...plain, active: false })).toBe(true);
  expect(unseen({ ...plain, level: "notification" })).toBe(false);
  expect(unseen({ ...plain, acknowledged_at: 3 })).toBe(false);
});

test("acknowledging says who, and reads that servo again", async () => {
  lists = { [A]: [plain] };
  await acknowledge(A, "one");
  expect(sent[0]).toMatch(new RegExp(`^POST servos/${A}/faults/one/acknowledge\\?by=page-\\d+$`));
  await vi.runAllTimersAsync();
  expect(sent[1]).toBe(`GET faults?uids=${A}`);
  sent = [];
  await acknowledge(A);
  expect(sent[0]).toMatch(new RegExp(`^POST servos/${A}/faults/acknowledge\\?by=`));
});

test("what could not be read is said, and what was known stays", async () => {
  lists = { [A]: [plain] };
  await read(A);
  broken = true;
  await read(A);
  expect(troubleOf([A])).not.toBeNull();
  expect(keys(faultsOf([A]).now)).toEqual(["one"]);
  broken = false;
  await read(A);
  expect(troubleOf([A])).toBeNull();
});

test("the response of one servo does not change another without a response", async () => {
  lists = { [A]: [plain], [B]: [plain] };
  broken = true;
  await read(A);
  broken = false;
  await read(B);
  expect(troubleOf([A, B])).not.toBeNull();
  expect(troubleOf([B])).toBeNull();
  await read(A);
  expect(troubleOf([A, B])).toBeNull();
});

test("one servo that the server does not know takes nothing from the others, and keeps what was known", async () => {
  lists = { [A]: [plain], [B]: [plain] };
  await read(A, B);
  unknown = B;
  lists = { [A]: [{ ...plain, key: "two" }] };
  await read(A, B);
  expect(keys(faultsOf([A]).now)).toEqual(["two"]);
  expect(keys(faultsOf([B]).now)).toEqual(["one"]);
  expect([troubleOf([A]), troubleOf([B])]).toEqual([null, expect.any(String)]);
});
