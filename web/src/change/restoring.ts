/** Restores outputs that Stop, a lease or a page switched off: dry run, then a job. */

import { type Signal, signal } from "@preact/signals";
import { Problem } from "../api/client";
import type { Job, OutputRestorePreview } from "../api/types";
import { stop } from "../bench/bench";
import { holder } from "../bench/holder";
import { motion, takeControl } from "../bench/motion";
import { forget } from "../bench/release";
import { route } from "../bench/route";
import { stopSeen } from "../bench/stop-sight";
import { text } from "../text";
import { beginChange, type ChangeRequest, type Report } from "./flow";
import { outputLease } from "./restorable";
import { followTogether, preview, startJob } from "./send";

export type Prospect = OutputRestorePreview["servos"][number];

export interface OutputFacts {
  plan: Signal<OutputRestorePreview | null>;
  /** Stop was pressed after the plan. */
  stopped: () => boolean;
}

/** Check everything and open the dialog. Returns the reason if refused. `uids`: null for all. */
export function planRestore(uids: readonly string[] | null): Promise<string | null> {
  return beginChange(outputChange(uids));
}

export function outputChange(uids: readonly string[] | null): ChangeRequest & { facts: OutputFacts } {
  const plan: OutputFacts["plan"] = signal(null);
  const opened = stop.peek()?.at ?? null;
  const facts = { plan, stopped: () => stop.value?.latched === true && stop.value.at !== opened };
  return {
    kind: "output",
    save: "never",
    together: true,
    facts,
    ready: () => !facts.stopped(),
    plan: async () => {
      const found = await preview("/stop/restore", {
        body: { uids, dry_run: true },
        ...leased(),
      });
      if (found.servos.length === 0) throw new Problem("nothing_to_restore", 0, text.output.nothing);
      plan.value = found;
      return found.servos.map(one => ({
        uid: one.uid,
        changes: [],
        problem: one.problem ? toProblem(one.problem) : null,
      }));
    },
    run: async (_, __, report) => {
      if (plan.value) await restore(plan.value, report);
    },
  };
}

export function toProblem(found: NonNullable<Prospect["problem"]>): Problem {
  return new Problem(found.code, found.status, found.detail, found);
}

/** Servos that would be switched on. */
export function able(plan: OutputRestorePreview): readonly Prospect[] {
  return plan.servos.filter(one => !one.problem);
}

/** Result of one servo in the job. */
export interface OutputRestored {
  uid: string;
  outcome: "not_tried" | "on" | "failed";
  angle_deg: number | null;
}

export function restoredBy(job: Job): readonly OutputRestored[] {
  return (job.result as { servos?: OutputRestored[] } | null)?.servos ?? [];
}

/** Run the confirmed plan. Takes motion control if a servo has a command timeout. */
export async function restore(plan: OutputRestorePreview, report: Report): Promise<void> {
  const uids = able(plan).map(one => one.uid);
  const here = route.peek().uid;
  // Its page shows it under command, and only its page.
  if (here && uids.includes(here)) uids.unshift(...uids.splice(uids.indexOf(here), 1));
  const confirm = able(plan).some(one => one.under_load) ? (["load"] as const) : [];
  const run = async (lease: string | null) => {
    const end = await followTogether(
      await startJob("/stop/restore", { body: { uids, confirm }, ...leased(lease) }),
      report,
    );
    const on = restoredBy(end).flatMap(one => (one.outcome === "on" ? [one.uid] : []));
    for (const uid of on) forget(uid);
    return on;
  };
  if (uids.length === 0) return;
  if (ownLease() === null && !able(plan).some(one => one.needs_lease)) {
    await run(null);
    return;
  }
  if (!stopSeen()) throw new Problem("stop_hidden", 0, text.motion.stopHidden);
  // A brake stays on if nothing was switched on: torque off is not written to it.
  await takeControl(uids, [], null, async lease => {
    outputLease.value = lease;
    return await run(lease);
  });
}

/** The lease of this page while it commands nothing under it. */
function ownLease(): string | null {
  const present = motion.peek();
  return present.phase === "held" ? present.lease : null;
}

const leased = (lease = ownLease()) => ({
  query: { by: holder() },
  headers: lease === null ? {} : { Lease: lease },
});
