/** Restarts and resets: confirmed first, done once and in turn, and the servos left out. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Profile } from "../api/config-types";
import { motion } from "../bench/motion";
import { begun, ChangeFlow, type ChangeRequest, closeChange, shownChange, underWay } from "./flow";
import { profileChange, resetChange, restartChange } from "./requests";

const [A, B, C] = ["a", "b", "c"].map(one => one.repeat(32)) as [string, string, string];

interface Sent {
  path: string;
  body: unknown;
  headers: Record<string, string>;
}

let sent: Sent[];
let fate: Record<string, { status: number; code?: string; error?: string }>;

beforeEach(() => {
  sent = [];
  fate = {};
  motion.value = { phase: "off", why: null };
  begun.value = [];
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const uid = /servos\/([a-c]{32})/.exec(url)?.[1] ?? "";
    if (init.method !== "POST") return new Response(JSON.stringify({ revision: "1", parameters: {} }));
    const headers = init.headers as Record<string, string>;
    sent.push({ path: url.replace(/^.*servos\//, ""), body: JSON.parse(String(init.body)), headers });
    const { status = 202, code, error } = fate[uid] ?? {};
    const job = {
      id: crypto.randomUUID(),
      uid,
      state: error ? "failed" : "succeeded",
      steps: [],
      error: error ? { code: error, detail: `It is ${error}.`, summary: `It is ${error}.` } : null,
    };
    const body = code ? { code, status, detail: `${code} here`, summary: `${code} here` } : job;
    return new Response(JSON.stringify(body), { status });
  });
});

afterEach(() => vi.unstubAllGlobals());

let flow: ChangeFlow;
const states = () => flow.turns.value.map(one => one.state);

/** Does it to all of these, as if the plan had refused none. */
async function run(request: ChangeRequest, uids: readonly string[]): Promise<void> {
  const plan = async () => uids.map(uid => ({ uid, changes: [] }));
  flow = new ChangeFlow({ ...request, plan, ready: () => true });
  await flow.look();
  await flow.go();
}

test("the plan is a dry run under the lease of this page", async () => {
  motion.value = { phase: "on", uid: A, lease: "mine", torque: "on", others: [] };
  await new ChangeFlow(restartChange([A])).look();
  const reset = resetChange(A, "Tail");
  reset.facts.keep.value = false;
  await new ChangeFlow(reset).look();
  expect(sent.map(one => [one.path.slice(33), one.body, one.headers.Lease])).toEqual([
    ["restart", { dry_run: true }, "mine"],
    ["factory-reset", { dry_run: true, keep_identity: false }, "mine"],
  ]);
});

test("a refused plan says why of its servo", async () => {
  fate = { [A]: { status: 423, code: "stopped" } };
  flow = new ChangeFlow(restartChange([A]));
  await flow.look();
  expect(flow.parts.value?.[0]?.problem).toMatchObject({ code: "stopped" });
});

test("each is sent once, in order, with a key that keeps a repeated request from doing it again", async () => {
  await run(restartChange([A, B]), [A, B]);
  expect(sent.map(one => one.path)).toEqual([`${A}/restart`, `${B}/restart`]);
  expect(new Set(sent.map(one => one.headers["Idempotency-Key"])).size).toBe(2);
  expect(states()).toEqual(["done", "done"]);
  expect(flow.well).toBe(true);
});

test("one that fails or is refused does not keep the others from it", async () => {
  fate = { [A]: { status: 202, error: "no_response" }, [B]: { status: 409, code: "busy" } };
  await run(restartChange([A, B, C]), [A, B, C]);
  expect(flow.turns.value.map(one => [one.state, one.why])).toEqual([
    ["failed", "It is no_response."],
    ["failed", "busy here"],
    ["done", null],
  ]);
});

test("after a stop no servo is restarted, and each gives the reason", async () => {
  fate = { [B]: { status: 423, code: "stopped" } };
  await run(restartChange([A, B, C]), [A, B, C]);
  expect(sent).toHaveLength(2);
  expect(states()).toEqual(["done", "left_out", "left_out"]);
  expect(flow.turns.value[2]?.why).toBe(flow.turns.value[1]?.why);
});

test("a reset carries what it is to keep", async () => {
  await run(resetChange(A, "Tail"), [A]);
  expect(sent[0]).toMatchObject({ path: `${A}/factory-reset`, body: { keep_identity: true } });
});

test("a change is under way on its servos until it is over, and one that went wrong unseen can be seen yet", async () => {
  fate = { [B]: { status: 202, error: "no_response" } };
  const seen: boolean[][] = [];
  const forget = begun.subscribe(list => {
    if (list.length > 0) seen.push([underWay([A]), underWay([B, C]), underWay([C])]);
  });
  await run(restartChange([A, B]), [A, B]);
  forget();
  expect(seen).toEqual([[true, true, false]]);
  expect([underWay([A, B]), begun.value]).toEqual([false, [flow]]);
  shownChange.value = flow;
  closeChange();
  expect(begun.value).toEqual([]);
});

test("servos that share a job are reported one by one", async () => {
  const applied = { outcome: "applied", changes: [], left_out: [], saved: false, problem: null };
  const problem = { code: "no_response", detail: "It is silent." };
  vi.stubGlobal("fetch", async (_: string, init: RequestInit) => {
    sent.push({ path: "", body: JSON.parse(String(init.body)), headers: {} });
    const servos = [
      { ...applied, uid: A },
      { ...applied, uid: B, outcome: "rolled_back", problem },
    ];
    const job = { id: crypto.randomUUID(), uid: null, state: "failed", steps: [], error: null };
    return new Response(JSON.stringify({ ...job, result: { servos } }), { status: 202 });
  });
  const request = profileChange({ name: "Rudder" } as Profile, [A, B, C]);
  await run(request, [A, B]);
  expect(sent.find(one => (one.body as { uids?: unknown }).uids)?.body).toMatchObject({ uids: [A, B] });
  expect(flow.turns.value.map(one => [one.uid, one.state, one.fault])).toEqual([
    [A, "done", null],
    [B, "failed", "rolled_back"],
  ]);
});
