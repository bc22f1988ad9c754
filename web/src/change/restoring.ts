/** Restoring outputs that Stop, motion control or a page switched off: the dry run, then the job that does it. */

import { computed, signal } from "@preact/signals";
import { ask, Problem, problemOf } from "../api/client";
import type { Job, OutputRestorePreview } from "../api/types";
import { problemText } from "../bench/facts";
import { all, type KnownServo } from "../bench/fleet";
import { holder } from "../bench/holder";
import { jobs, setJob, settled } from "../bench/jobs";
import { motion, takeControl } from "../bench/motion";
import { switchedOff } from "../bench/output";
import { forget } from "../bench/release";
import { route } from "../bench/route";
import { stopSeen } from "../bench/stop-sight";
import { text } from "../text";

/** Servos whose output the session took and can give back. */
export const restorable = computed(() => all.value.filter(canRestore));

export function canRestore(one: KnownServo): boolean {
  return one.online && one.known_model && switchedOff(one.output);
}

export type Prospect = OutputRestorePreview["servos"][number];

/** What the dialog asks about, found by a dry run; null while it is closed. */
export const planned = signal<OutputRestorePreview | null>(null);

/** The lease that was taken to keep outputs on. */
export const keptOn = signal<string | null>(null);

/** Has the server check everything, and opens the dialog. The answer is why not, in words. `uids`: null for all. */
export async function planRestore(uids: readonly string[] | null): Promise<string | null> {
  try {
    const found = await send<OutputRestorePreview>({ uids, dry_run: true }, ownLease());
    const problem = found.servos.every(one => one.problem) ? found.servos[0]?.problem : undefined;
    if (problem) return problemText(toProblem(problem));
    if (found.servos.length === 0) return text.output.nothing;
    planned.value = found;
    return null;
  } catch (error) {
    return problemText(problemOf(error));
  }
}

export function toProblem(found: NonNullable<Prospect["problem"]>): Problem {
  return new Problem(found.code, found.status, found.detail, found);
}

/** Those that would be switched on. */
export function able(plan: OutputRestorePreview): readonly Prospect[] {
  return plan.servos.filter(one => !one.problem);
}

/** What the job did with one servo. */
export interface OutputRestored {
  uid: string;
  outcome: "not_tried" | "on" | "failed";
  angle_deg: number | null;
}

export function restoredBy(job: Job): readonly OutputRestored[] {
  return (job.result as { servos?: OutputRestored[] } | null)?.servos ?? [];
}

/** Does what was planned and agreed to; `begun` is told the job. Takes motion control where a servo lets go by itself. */
export async function restore(plan: OutputRestorePreview, begun: (id: string) => void): Promise<void> {
  const uids = able(plan).map(one => one.uid);
  const here = route.peek().uid;
  // Its page shows it under command, not another of them.
  if (here && uids.includes(here)) uids.unshift(...uids.splice(uids.indexOf(here), 1));
  const confirm = able(plan).some(one => one.under_load) ? ["load"] : [];
  const run = async (lease: string | null) => {
    const job = await send<Job>({ uids, confirm }, lease);
    // What the socket told of it meanwhile is newer than this answer.
    if (!jobs.peek().has(job.id)) setJob(job);
    begun(job.id);
    const done = restoredBy(await settled(job.id));
    const on = done.flatMap(one => (one.outcome === "on" ? [one.uid] : []));
    for (const uid of on) forget(uid);
    return on;
  };
  const first = uids[0];
  if (first === undefined) return;
  if (ownLease() === null && !able(plan).some(one => one.needs_lease)) {
    await run(null);
    return;
  }
  if (!stopSeen()) throw new Problem("stop_hidden", 0, text.motion.stopHidden);
  // A brake stays on where nothing came on: no torque off is written to it.
  await takeControl(first, [], null, async lease => {
    keptOn.value = lease;
    return await run(lease);
  });
}

/** The lease of this page while it commands nothing under it. */
function ownLease(): string | null {
  const present = motion.peek();
  return present.phase === "held" ? present.lease : null;
}

function send<Answer>(body: object, lease: string | null): Promise<Answer> {
  return ask<Answer>("POST", `/stop/restore?by=${encodeURIComponent(holder())}`, {
    body,
    headers: lease === null ? {} : { Lease: lease },
    timeout_ms: 30_000,
  });
}
