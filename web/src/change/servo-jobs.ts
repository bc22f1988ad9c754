/** Restarts and factory resets: what each would do, asked beforehand, and the jobs that do it, one servo at a time. */

import { signal } from "@preact/signals";
import { ask, type Problem, problemOf } from "../api/client";
import type { ResetPreview, RestartPreview } from "../api/config-types";
import type { Job } from "../api/types";
import { endText, problemText } from "../bench/facts";
import { jobs, setJob, settled } from "../bench/jobs";
import { leaseHeader } from "../bench/motion";
import { readSheet } from "../bench/parameters";

export type Verb = "restart" | "factory-reset";

/** Reading every row of a servo that is slow to answer takes a while. */
const PLAN_MS = 30_000;

/** Everything the server can check beforehand, and what is lost. Throws the refusal of the real restart. */
export function planRestart(uid: string): Promise<RestartPreview> {
  return ask<RestartPreview>("POST", `/servos/${uid}/restart`, {
    body: { dry_run: true },
    headers: leaseHeader(),
    timeout_ms: PLAN_MS,
  });
}

/** As `planRestart`, of a factory reset. */
export function planReset(uid: string, keepIdentity: boolean): Promise<ResetPreview> {
  return ask<ResetPreview>("POST", `/servos/${uid}/factory-reset`, {
    body: { dry_run: true, keep_identity: keepIdentity },
    headers: leaseHeader(),
    timeout_ms: PLAN_MS,
  });
}

export interface Turn {
  uid: string;
  state: "waiting" | "running" | "done" | "failed" | "left_out";
  /** The id of its job, once it is started. */
  job: string | null;
  /** Why it failed. */
  why: string | null;
}

/** The restarts or the reset under way, or just ended; null before the first. */
export const servoTurns = signal<{ verb: Verb; turns: readonly Turn[] } | null>(null);

export function turnsUnderWay(): boolean {
  return servoTurns.value?.turns.some(one => one.state === "running" || one.state === "waiting") ?? false;
}

/** Refusals before the start that every other servo would meet as well. */
const OF_ALL = new Set(["stopped", "lease_held", "bus_disconnected", "no_link", "unauthorized"]);

/** Does it to each in this order. The others go on when one fails; none is started after a stop. */
export async function runInTurn(verb: Verb, uids: readonly string[], body: object = {}): Promise<void> {
  if (turnsUnderWay()) return;
  servoTurns.value = { verb, turns: uids.map(uid => ({ uid, state: "waiting", job: null, why: null })) };
  let end: Problem | null = null;
  for (const uid of uids) {
    if (end !== null) change(uid, { state: "left_out", why: problemText(end) });
    else end = await run(verb, uid, body);
  }
}

function change(uid: string, to: Partial<Turn>): void {
  const present = servoTurns.peek();
  if (present)
    servoTurns.value = {
      ...present,
      turns: present.turns.map(one => (one.uid === uid ? { ...one, ...to } : one)),
    };
}

/** Null when the next one may be tried, else the refusal that holds for it as well. */
async function run(verb: Verb, uid: string, body: object): Promise<Problem | null> {
  change(uid, { state: "running" });
  try {
    // Once only, however often the request is sent.
    const once = crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}`;
    const headers = { ...leaseHeader(), "Idempotency-Key": once };
    const job = await ask<Job>("POST", `/servos/${uid}/${verb}`, { body, headers });
    if (!jobs.peek().has(job.id)) setJob(job);
    change(uid, { job: job.id });
    const end = await settled(job.id);
    const well = end.state === "succeeded";
    change(uid, {
      state: well ? "done" : "failed",
      why: well ? null : endText(end),
    });
    readSheet(uid);
    return null;
  } catch (error) {
    const problem = problemOf(error);
    const all = OF_ALL.has(problem.code);
    change(uid, { state: all ? "left_out" : "failed", why: problemText(problem) });
    return all ? problem : null;
  }
}
