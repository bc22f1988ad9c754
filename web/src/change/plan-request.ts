/** A test plan, and the continuation of one that was interrupted, as changes. The server runs it as a job. */

import { type Signal, signal } from "@preact/signals";
import { callApi } from "../api/client";
import type { Job, PlanPreview, ProblemBody } from "../api/types";
import { endText } from "../bench/facts";
import { setJob, settled } from "../bench/jobs";
import { leaseHeader } from "../bench/motion";
import { asProblem } from "../bench/parameters";
import type { ChangeRequest, Report } from "./flow";
import { preview, send } from "./send";

export interface PlanFacts {
  name: string;
  /** Result of the last dry run. */
  preview: Signal<PlanPreview | null>;
}

/** Result of the job of a plan, as far as the page shows it. */
export interface PlanResult {
  plan: string;
  cycles: number;
  cycles_done: number;
  next: [number, number];
}

export const planResult = (job: Job) => (job.kind === "plan" ? (job.result as PlanResult | null) : null);

/** `file`: text of a plan file, TOML. */
export function planChange(file: string): ChangeRequest & { facts: PlanFacts } {
  const facts: PlanFacts = { name: "", preview: signal(null) };
  return {
    kind: "plan",
    save: "never",
    together: true,
    facts,
    ready: () => facts.preview.value?.servos.every(one => !one.problem) ?? false,
    plan: async ({ confirm }) => {
      const found = (await preview("/plans", {
        // The server reads the file: a browser cannot.
        body: { plan: file, confirm: [...confirm], dry_run: true },
        headers: leaseHeader(),
        timeout_ms: 60_000,
      })) as PlanPreview;
      facts.preview.value = found;
      facts.name = found.name;
      return found.servos.map(one => ({
        uid: one.uid,
        changes: [],
        problem: one.problem && asProblem(one.problem as ProblemBody),
      }));
    },
    run: ({ confirm }, _, report) =>
      follow(
        send("POST", "/plans", {
          body: { plan: file, confirm: [...confirm], by: "page" },
          headers: leaseHeader(),
        }),
        report,
      ),
  };
}

/** Continue where the job ended. */
export function resumePlan(job: Job): ChangeRequest & { facts: PlanFacts } {
  return {
    kind: "plan-resume",
    save: "never",
    together: true,
    facts: { name: planResult(job)?.plan ?? "", preview: signal(null) },
    run: (_, __, report) =>
      follow(
        send("POST", "/jobs/{job_id}/resume", { path: { job_id: job.id }, headers: leaseHeader() }),
        report,
      ),
  };
}

/** End the run; torque goes off. */
export async function endPlan(job: Job): Promise<void> {
  setJob(await callApi("DELETE", "/jobs/{job_id}", { path: { job_id: job.id } }));
}

async function follow(started: Promise<unknown>, report: Report): Promise<void> {
  const job = (await started) as Job;
  setJob(job);
  report("", { job: job.id, state: "running" });
  const end = await settled(job.id);
  report("", end.state === "succeeded" ? { state: "done" } : { state: "failed", why: endText(end) });
}
