/** Measurements of the Tune page: one request a press, gains first, motion first, and what is shown afterwards. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Job } from "../api/types";
import { jobs, setJob } from "../bench/jobs";
import { link } from "../bench/link";
import { motion } from "../bench/motion";
import { sheetOf } from "../bench/parameters";
import {
  chosenRuns,
  dismissJob,
  runAgain,
  test as shown,
  showServo,
  startStep,
  testing,
  testProblem,
} from "./state";

const UID = "d".repeat(32);
const options = { step_deg: 5, runs: 1, dwell_s: 1, note: "" };
let posts: string[];
let respond: (response: Response) => void;

/** Empty responses of the requests that load the page. */
function loaded(url: string): Response {
  if (/set-up|tuning|mechanics/.test(url)) return new Response("{}");
  return new Response(url.includes("/parameters") ? '{"revision":"2","parameters":{}}' : "[]");
}

const refusal = () =>
  new Response(JSON.stringify({ code: "busy", detail: "The servo is busy." }), { status: 409 });

beforeEach(() => {
  posts = [];
  link.value = { state: "up", since: 0 };
  motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
  vi.stubGlobal("fetch", (url: string, init: RequestInit) => {
    if (init.method !== "POST") return Promise.resolve(loaded(url));
    posts.push(url);
    return new Promise<Response>(resolve => {
      respond = resolve;
    });
  });
});

afterEach(() => {
  motion.value = { phase: "off", why: null };
  jobs.value = new Map();
  dismissJob();
  vi.unstubAllGlobals();
});

test("two presses send one request, and a refusal lets the next press through", async () => {
  await showServo(UID);
  const first = runAgain(UID, options);
  const second = runAgain(UID, options);
  expect(testing.value).toBe(true);
  await second;
  await vi.waitFor(() => expect(posts).toHaveLength(1));
  respond(refusal());
  await first;
  expect(testing.value).toBe(false);
  expect(testProblem.value).toBe("The servo is busy.");
  const third = runAgain(UID, options);
  await vi.waitFor(() => expect(posts).toHaveLength(2));
  respond(refusal());
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
      if (init.method === "GET") return loaded(url);
      order.push(`${init.method} ${url.replace(/^.*servos\/\w+\//, "")}`);
      if (init.method === "PATCH")
        return new Response(JSON.stringify(patched.body), { status: patched.status });
      return refusal();
    });
    await showServo(UID);
  });

  test("writes the gains, then runs", async () => {
    patched = { status: 200, body: written("applied") };
    await runAgain(UID, options);
    expect(order).toEqual(["PATCH parameters", "POST step-test"]);
  });

  test.each([
    ["refused", { status: 409, body: { code: "busy", detail: "The servo is busy." } }],
    ["clamped by the servo", { status: 200, body: written("clamped") }],
  ])("runs nothing when they were %s, and says so", async (_, applied) => {
    patched = applied;
    await runAgain(UID, options);
    expect(order).toEqual(["PATCH parameters"]);
    expect(testProblem.value).toContain("not run");
  });

  test("runs alone where nothing is staged", async () => {
    sheetOf(UID).drafts.clear();
    await runAgain(UID, options);
    expect(order).toEqual(["POST step-test"]);
  });
});

test("nothing is requested while motion is on for another servo", async () => {
  motion.value = { phase: "on", uid: "e".repeat(32), lease: "L", torque: "on", others: [] };
  await showServo(UID);
  await expect(startStep(UID, options)).rejects.toThrow("not enabled");
  expect(posts).toEqual([]);
  expect(testing.value).toBe(false);
});

describe("a job", () => {
  const job = (more: Partial<Job>): Job =>
    ({
      id: "j1",
      uid: UID,
      kind: "step_test",
      state: "running",
      steps: [],
      error: null,
      result: null,
      ...more,
    }) as Job;

  test("of another client is followed, and its run is shown", async () => {
    await showServo(UID);
    const overlays: string[] = [];
    vi.stubGlobal("fetch", async (url: string) => {
      if (url.includes("/runs/overlay")) overlays.push(url);
      if (url.includes("/runs?")) return new Response(JSON.stringify([{ id: 7 }]));
      return url.includes("/runs/overlay") ? new Response('{"runs":[],"differences":{}}') : loaded(url);
    });
    setJob(job({}));
    expect(testing.value).toBe(true);
    setJob(job({ state: "succeeded", result: { run: 7 } }));
    await vi.waitFor(() => expect(overlays).toHaveLength(1));
    expect(chosenRuns.value).toEqual([7]);
    expect(shown.value).toBeNull();
  });

  test("that failed is shown until it is closed", async () => {
    await showServo(UID);
    setJob(job({ id: "j2" }));
    setJob(job({ id: "j2", state: "failed" }));
    expect(shown.value?.state).toBe("failed");
    expect(testing.value).toBe(false);
    dismissJob();
    expect(shown.value).toBeNull();
  });

  test("of another servo, or of another kind, is not shown", async () => {
    await showServo(UID);
    setJob(job({ id: "j3", uid: "e".repeat(32) }));
    setJob(job({ id: "j4", kind: "save" }));
    expect(shown.value).toBeNull();
  });
});
