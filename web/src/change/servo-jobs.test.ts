/** Restarts and resets: asked about first, done once and in turn, and who is left out. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { motion } from "../bench/motion";
import { planReset, planRestart, runInTurn, servoTurns, turnsUnderWay } from "./servo-jobs";

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
  servoTurns.value = null;
  motion.value = { phase: "off", why: null };
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

const states = () => servoTurns.value?.turns.map(one => one.state);

test("the plan is a dry run under the lease of this page", async () => {
  motion.value = { phase: "on", uid: A, lease: "mine", torque: "on", others: [] };
  await planRestart(A);
  await planReset(A, false);
  expect(sent.map(one => [one.path.slice(33), one.body, one.headers.Lease])).toEqual([
    ["restart", { dry_run: true }, "mine"],
    ["factory-reset", { dry_run: true, keep_identity: false }, "mine"],
  ]);
});

test("a refused plan is thrown as it is", async () => {
  fate = { [A]: { status: 423, code: "stopped" } };
  await expect(planRestart(A)).rejects.toMatchObject({ code: "stopped" });
});

test("each is sent once, in order, with a key that keeps a repeated request from doing it again", async () => {
  await runInTurn("restart", [A, B]);
  expect(sent.map(one => one.path)).toEqual([`${A}/restart`, `${B}/restart`]);
  expect(new Set(sent.map(one => one.headers["Idempotency-Key"])).size).toBe(2);
  expect(states()).toEqual(["done", "done"]);
  expect(turnsUnderWay()).toBe(false);
});

test("one that fails or is refused does not keep the others from it", async () => {
  fate = { [A]: { status: 202, error: "no_answer" }, [B]: { status: 409, code: "busy" } };
  await runInTurn("restart", [A, B, C]);
  expect(servoTurns.value?.turns.map(one => [one.state, one.why])).toEqual([
    ["failed", "It is no_answer."],
    ["failed", "busy here"],
    ["done", null],
  ]);
});

test("after a stop nobody is restarted any more, and each says why", async () => {
  fate = { [B]: { status: 423, code: "stopped" } };
  await runInTurn("restart", [A, B, C]);
  expect(sent).toHaveLength(2);
  expect(states()).toEqual(["done", "left_out", "left_out"]);
  expect(servoTurns.value?.turns[2]?.why).toBe(servoTurns.value?.turns[1]?.why);
});

test("a reset carries what it is to keep", async () => {
  await runInTurn("factory-reset", [A], { keep_identity: true });
  expect(sent[0]).toMatchObject({ path: `${A}/factory-reset`, body: { keep_identity: true } });
  expect(servoTurns.value?.verb).toBe("factory-reset");
});
