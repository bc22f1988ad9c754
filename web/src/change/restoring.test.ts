/** Restoring outputs: the requests after confirmation, and those not sent after a failure. */
import { beforeEach, expect, test, vi } from "vitest";
import type { OutputRestorePreview } from "../api/types";
import { stop } from "../bench/bench";
import { link } from "../bench/link";
import { endMotion, motion } from "../bench/motion";
import { stopButton } from "../testing/stop-button";
import { shownChange } from "./flow";
import { type OutputFacts, type Prospect, planRestore, restore } from "./restoring";

const [FREE, BRAKED, HOT] = ["a", "b", "c"].map(one => one.repeat(32)) as [string, string, string];
const HOT_PROBLEM = {
  type: "",
  title: "",
  status: 409,
  code: "busy",
  detail: "It protects itself.",
  summary: "It protects itself.",
  cause: null,
  params: {},
};

let jobs = 0;
let sent: string[];
let refuse: string | null;
let plan: OutputRestorePreview;

function prospect(uid: string, more: Partial<Prospect> = {}): Prospect {
  const output = { state: "off", reason: "stop", by: "Kim", since: null } as const;
  const one = {
    uid,
    title: uid,
    output,
    torque_pct: 0,
    under_load: false,
    needs_lease: false,
    problem: null,
  };
  return { ...one, ...more };
}

beforeEach(() => {
  endMotion(null);
  sent = [];
  refuse = null;
  shownChange.value = null;
  plan = { clears_stop: true, servos: [] };
  link.value = { state: "up", since: 0 };
  stop.value = null;
  stopButton();
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const path = url.replace("/api/v1", "").replace(/\?.*/, "");
    const body = init.body ? JSON.parse(String(init.body)) : {};
    const lease = (init.headers as Record<string, string>).Lease ? " leased" : "";
    sent.push(
      `${init.method} ${path}${body.uids ? ` ${body.uids.map((u: string) => u[0])}` : ""}${body.confirm ? ` [${body.confirm}]` : ""}${lease}`,
    );
    if (path === "/leases") return new Response(JSON.stringify({ id: "L".repeat(32) }));
    if (path.endsWith("/torque")) return new Response(JSON.stringify({ value: "off" }));
    if (path !== "/stop/restore") return new Response(null, { status: 204 });
    if (refuse) {
      const problem = { code: refuse, detail: "No.", summary: "No.", facts: {} };
      return new Response(JSON.stringify(problem), { status: 409 });
    }
    if (body.dry_run) return new Response(JSON.stringify(plan));
    const servos = body.uids.map((uid: string) => ({ uid, outcome: "on", angle_deg: 1 }));
    const job = {
      id: `job ${jobs++}`,
      kind: "restore_output",
      state: "succeeded",
      steps: [],
      error: null,
      result: { servos },
    };
    return new Response(JSON.stringify(job), { status: 202 });
  });
});

test("the dialog opens when the dry run has succeeded, and not when it was refused", async () => {
  refuse = "busy";
  expect(await planRestore(null)).not.toBeNull();
  expect(shownChange.value).toBeNull();
  refuse = null;
  expect(await planRestore(null), "no servo to restore").not.toBeNull();
  plan.servos = [prospect(HOT, { problem: HOT_PROBLEM })];
  expect(await planRestore(null), "none that could be").not.toBeNull();
  expect(shownChange.value).toBeNull();
  plan.servos = [prospect(FREE), prospect(HOT, { problem: HOT_PROBLEM })];
  expect(await planRestore(null)).toBeNull();
  expect((shownChange.value?.request.facts as OutputFacts | undefined)?.plan.value).toEqual(plan);
});

test("those that were named are restored, a load is agreed to only where one was named, and no lease is taken", async () => {
  plan.servos = [
    prospect(FREE),
    prospect(HOT, { problem: HOT_PROBLEM, under_load: true, needs_lease: true }),
  ];
  await restore(plan, () => undefined);
  expect(sent).toEqual(["POST /stop/restore a []"]);
  sent = [];
  plan.servos = [prospect(FREE), prospect(BRAKED, { under_load: true })];
  await restore(plan, () => undefined);
  expect(sent).toEqual(["POST /stop/restore a,b [load]"]);
  expect(motion.value.phase).toBe("off");
});

test("motion control is taken for a servo with a timeout, and kept for those that are on", async () => {
  plan.servos = [prospect(FREE, { needs_lease: true }), prospect(BRAKED, { under_load: true })];
  await restore(plan, () => undefined);
  expect(sent).toEqual(["POST /leases a,b", "POST /stop/restore a,b [load] leased"]);
  expect(motion.value).toMatchObject({ phase: "on", uid: FREE, others: [BRAKED], torque: "on" });
});

test("a rejection releases the lease and writes torque off to no servo: a brake stays on", async () => {
  refuse = "busy";
  plan.servos = [prospect(BRAKED, { needs_lease: true, under_load: true })];
  await expect(restore(plan, () => undefined)).rejects.toMatchObject({ code: "busy" });
  expect(sent.filter(one => one.includes("/torque"))).toEqual([]);
  expect(sent.at(-1)).toMatch(/^DELETE \/leases\//);
  expect(motion.value.phase).toBe("off");
});

test("cancelled while outputs come on, it releases the lease, and a brake of a stop stays on", async () => {
  plan.servos = [prospect(BRAKED, { needs_lease: true, under_load: true })];
  await restore(plan, () => endMotion("stopped"));
  expect(sent.filter(one => one.includes("/torque"))).toEqual([]);
  expect(sent.at(-1)).toMatch(/^DELETE \/leases\//);
  expect(motion.value.phase).toBe("off");
});
