/** Rows of many servos: one request for all that are shown, and none for those that are known. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PAUSE_MS } from "./batched";
import { sheetOf, wantSheet } from "./parameters";

const uids = Array.from({ length: 40 }, (_, n) => n.toString(16).padStart(32, "0"));
let sent: string[];
let broken: boolean;
let unknown: string;

const gone = { code: "unknown_servo", status: 404, detail: "no such servo" };

function columnOf(uid: string) {
  if (uid === unknown) return { revision: null, parameters: {}, problem: gone };
  return { revision: "r", parameters: {}, problem: null };
}

beforeEach(() => {
  vi.useFakeTimers();
  sent = [];
  broken = false;
  unknown = "";
  vi.stubGlobal("fetch", async (url: string) => {
    sent.push(url);
    if (broken) return new Response("{}", { status: 500 });
    const listed = new URL(url, "http://x").searchParams.get("uids")?.split(",") ?? [];
    const servos = Object.fromEntries(listed.map(uid => [uid, columnOf(uid)]));
    return new Response(JSON.stringify({ servos }));
  });
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

async function want(as: string, wanted = uids): Promise<void> {
  for (const uid of wanted) wantSheet(uid, as);
  await vi.runAllTimersAsync();
}

test("forty rows take one request, and showing them again takes none", async () => {
  await want("first");
  expect(sent).toEqual([`/api/v1/parameters?uids=${uids.join(",")}`]);
  expect(sheetOf(uids[39] ?? "").keys.value).toEqual([]);
  await want("first");
  expect(sent).toHaveLength(1);
});

test("servos that start again one after another share requests", async () => {
  for (const uid of uids) {
    wantSheet(uid, "again");
    await vi.advanceTimersByTimeAsync(20);
  }
  await vi.runAllTimersAsync();
  const requested = sent.map(url => new URL(url, "http://x").searchParams.get("uids")?.split(",") ?? []);
  expect(requested.length).toBeLessThanOrEqual((40 * 20) / PAUSE_MS + 2);
  expect(requested.flat()).toEqual(uids);
});

test("a servo that is another since is read again, alone", async () => {
  await want("second");
  sent = [];
  await want("third", uids.slice(3, 4));
  expect(sent).toEqual([`/api/v1/parameters?uids=${uids[3]}`]);
});

test("a failed read gives its reason, and is repeated when shown again", async () => {
  broken = true;
  await want("fourth", uids.slice(0, 2));
  expect(sheetOf(uids[0] ?? "").problem.value).not.toBeNull();
  broken = false;
  await want("fourth", uids.slice(0, 2));
  expect(sent).toHaveLength(2);
  expect(sheetOf(uids[0] ?? "").problem.value).toBeNull();
});

test("only the unknown servo has an error, and is requested again", async () => {
  const [first = "", second = ""] = uids;
  unknown = second;
  await want("fifth", [first, second]);
  expect(sheetOf(first).problem.value).toBeNull();
  expect(sheetOf(second).problem.value?.code).toBe("unknown_servo");
  unknown = "";
  await want("fifth", [first, second]);
  expect(sent[1]).toBe(`/api/v1/parameters?uids=${second}`);
  expect(sheetOf(second).problem.value).toBeNull();
});
