/** Faults: which are now, in what order they stand, and which still want to be acknowledged. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Fault } from "../api/types";
import { acknowledge, faultsOf, readFaults, trouble, unseen } from "./faults";

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
};
let lists: Record<string, Fault[]>;
let sent: string[];
let broken = false;

beforeEach(() => {
  sent = [];
  broken = false;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const path = url.replace("/api/v1/servos/", "");
    sent.push(`${init.method} ${path}`);
    if (broken) return new Response("{}", { status: 500 });
    return new Response(JSON.stringify(lists[path.slice(0, 32)]));
  });
});

afterEach(() => vi.unstubAllGlobals());

const keys = (lines: { key: string }[]) => lines.map(one => one.key);

test("what is now stands before what was, worst first, and unseen before seen", async () => {
  lists = {
    [A]: [
      { ...plain, key: "seen", acknowledged_at: 3, acknowledged_by: "Page 1", last_seen: 9 },
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
  await Promise.all([readFaults(A), readFaults(B)]);
  const { now, past } = faultsOf([A, B]);
  expect(keys(now)).toEqual(["broken", "silent", "newer", "unseen", "seen", "notice"]);
  expect(keys(past)).toEqual(["gone"]);
  expect(keys(faultsOf([A]).now)).toEqual(["unseen", "seen"]);
});

test("notifications want no acknowledgement, and neither does what somebody has seen", () => {
  expect(unseen(plain)).toBe(true);
  expect(unseen({ ...plain, active: false })).toBe(true);
  expect(unseen({ ...plain, level: "notification" })).toBe(false);
  expect(unseen({ ...plain, acknowledged_at: 3 })).toBe(false);
});

test("acknowledging says who, and reads that servo again", async () => {
  lists = { [A]: [plain] };
  await acknowledge(A, "one");
  expect(sent[0]).toMatch(new RegExp(`^POST ${A}/faults/one/acknowledge\\?by=Page%20\\d+$`));
  expect(sent[1]).toBe(`GET ${A}/faults`);
  sent = [];
  await acknowledge(A);
  expect(sent[0]).toMatch(new RegExp(`^POST ${A}/faults/acknowledge\\?by=`));
});

test("what could not be read is said, and what was known stays", async () => {
  lists = { [A]: [plain] };
  await readFaults(A);
  broken = true;
  await readFaults(A);
  expect(trouble.value).not.toBeNull();
  expect(keys(faultsOf([A]).now)).toEqual(["one"]);
  broken = false;
  await readFaults(A);
  expect(trouble.value).toBeNull();
});
