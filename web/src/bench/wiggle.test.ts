/** Wiggles: one horn at a time, each servo in turn, and which refusals end a round. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { stopButton } from "../testing/stop-button";
import { endRound, round, wiggle, wiggled, wiggleInTurn, wiggling } from "./wiggle";

const [A, B, C] = ["a", "b", "c"].map(one => one.repeat(32)) as [string, string, string];

let requested: string[];
let noStop: () => void;
/** What the server makes of each servo: a problem's code, or how the job ends. */
let fate: Record<string, { status: number; code?: string; error?: string }>;
/** Requests without a response, while `held` is set. */
let held: (() => void)[] | null;

const job = (uid: string, error?: string) => ({
  id: crypto.randomUUID(),
  kind: "identify",
  uid,
  state: error ? "failed" : "succeeded",
  steps: [],
  result: error ? null : { low_deg: -2.9, high_deg: 3.1 },
  error: error ? { code: error, detail: `It is ${error}.`, summary: `It is ${error}.` } : null,
});

beforeEach(() => {
  requested = [];
  noStop = stopButton();
  fate = {};
  held = null;
  wiggled.value = null;
  round.value = null;
  vi.stubGlobal("fetch", async (url: string) => {
    const uid = /servos\/([a-c]{32})\/identify/.exec(url)?.[1] ?? "";
    requested.push(uid);
    if (held !== null) await new Promise<void>(resolve => held?.push(resolve));
    const { status = 202, code, error } = fate[uid] ?? {};
    const body = code ? { code, status, detail: `${code} here`, summary: `${code} here` } : job(uid, error);
    return new Response(JSON.stringify(body), { status });
  });
});

afterEach(() => {
  noStop();
  vi.unstubAllGlobals();
});

test("reports how far the horn moved", async () => {
  await wiggle(A);
  expect(wiggled.value).toEqual({ uid: A, phase: "moved", low: -2.9, high: 3.1 });
});

test("a second one waits for nothing and does nothing while the first is under way", async () => {
  held = [];
  const first = wiggle(A);
  await vi.waitFor(() => expect(held).toHaveLength(1));
  await wiggle(B);
  await wiggleInTurn([B, C]);
  expect(wiggling.value).toBe(true);
  for (const go of held) go();
  await first;
  expect(requested).toEqual([A]);
});

test("several go in turn, and one that is refused does not keep the others from it", async () => {
  fate = { [B]: { status: 409, code: "busy" } };
  await wiggleInTurn([A, B, C]);
  expect(requested).toEqual([A, B, C]);
  expect(round.value?.at).toBe(3);
  expect([...(round.value?.refused ?? [])]).toEqual([[B, "busy here"]]);
});

test("a job that fails is a refusal of that servo", async () => {
  fate = { [A]: { status: 202, error: "did_not_move" } };
  await wiggleInTurn([A, B]);
  expect(round.value?.refused.get(A)).toBe("It is did_not_move.");
  expect(requested).toEqual([A, B]);
});

test.each(["stopped", "lease_held"])("%s applies to all: no further servo is requested", async code => {
  fate = { [A]: { status: 423, code } };
  await wiggleInTurn([A, B, C]);
  expect(requested).toEqual([A]);
  expect(round.value).toMatchObject({ uids: [A], at: 1 });
});

test("a stop in the middle of a wiggle ends the round", async () => {
  fate = { [A]: { status: 202, error: "stopped" } };
  await wiggleInTurn([A, B]);
  expect(requested).toEqual([A]);
});

test("the rest is left out on request; the one under way ends as it would", async () => {
  held = [];
  const turn = wiggleInTurn([A, B, C]);
  await vi.waitFor(() => expect(held).toHaveLength(1));
  endRound();
  for (const go of held) go();
  await turn;
  expect(requested).toEqual([A]);
  expect(wiggled.value?.phase).toBe("moved");
});

test("nothing wiggles while Stop is out of sight", async () => {
  noStop();
  await wiggleInTurn([A, B]);
  expect(requested).toEqual([]);
  expect(round.value?.refused.size).toBe(1);
});
