/** A step test: repeated starts before the response send one request. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { link } from "../bench/link";
import { motion } from "../bench/motion";
import { sheetOf } from "../bench/parameters";
import { applyAndTest, showServo, startTest, testing, testProblem } from "./state";

const UID = "d".repeat(32);
const options = { step_deg: 5, runs: 1, dwell_s: 1, note: "" };
let posts: string[];
let respond: (response: Response) => void;

beforeEach(() => {
  posts = [];
  link.value = { state: "up", since: 0 };
  motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
  vi.stubGlobal("fetch", (url: string, init: RequestInit) => {
    if (init.method !== "POST") return Promise.resolve(new Response("[]"));
    posts.push(url);
    return new Promise<Response>(resolve => {
      respond = resolve;
    });
  });
});

afterEach(() => {
  motion.value = { phase: "off", why: null };
  vi.unstubAllGlobals();
});

test("two presses send one request, and a refusal lets the next press through", async () => {
  await showServo(UID);
  const first = startTest(UID, options);
  const second = startTest(UID, options);
  expect(testing.value).toBe(true);
  await second;
  expect(posts).toHaveLength(1);
  respond(new Response(JSON.stringify({ code: "busy", detail: "The servo is busy." }), { status: 409 }));
  await first;
  expect(testing.value).toBe(false);
  expect(testProblem.value).not.toBeNull();
  const third = startTest(UID, options);
  expect(posts).toHaveLength(2);
  respond(new Response(JSON.stringify({ code: "busy", detail: "The servo is busy." }), { status: 409 }));
  await third;
});

describe("applying and running in one press", () => {
  const written = (verdict: string) => ({
    outcome: "applied",
    revision: "2",
    changes: [{ key: "angle_p_gain", before: 40, requested: 30, after: 30, verdict }],
  });
  let order: string[];
  let patched: { status: number; body: unknown };

  beforeEach(async () => {
    order = [];
    const sheet = sheetOf(UID);
    sheet.put({ key: "angle_p_gain", value: 40, raw: 40, rom: 40, default: 40, age_s: 0 } as never);
    sheet.drafts.clear();
    sheet.drafts.put("angle_p_gain", { text: "30", verdict: { ok: true, value: 30 } });
    vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
      if (init.method === "GET")
        return new Response(url.includes("/parameters") ? '{"revision":"2","parameters":{}}' : "[]");
      order.push(`${init.method} ${url.replace(/^.*servos\/\w+\//, "")}`);
      if (init.method === "PATCH")
        return new Response(JSON.stringify(patched.body), { status: patched.status });
      return new Response(JSON.stringify({ code: "busy", detail: "Enough." }), { status: 409 });
    });
    await showServo(UID);
  });

  test("writes the gains, then runs", async () => {
    patched = { status: 200, body: written("applied") };
    await applyAndTest(UID, options);
    expect(order).toEqual(["PATCH parameters", "POST step-test"]);
  });

  test.each([
    ["refused", { status: 409, body: { code: "busy", detail: "The servo is busy." } }],
    ["clamped by the servo", { status: 200, body: written("clamped") }],
  ])("runs nothing when they were %s, and says so", async (_, applied) => {
    patched = applied;
    await applyAndTest(UID, options);
    expect(order).toEqual(["PATCH parameters"]);
    expect(testProblem.value).toContain("not run");
  });

  test("runs alone where nothing is staged", async () => {
    sheetOf(UID).drafts.clear();
    await applyAndTest(UID, options);
    expect(order).toEqual(["POST step-test"]);
  });
});
