/** Owns what the jobs of commissioning say of each servo: its steps, its verdict, and what to do. No elements. */
import type { Job, JobStep } from "../api/types";

export type Verdict = "waiting" | "running" | "done" | "failed" | "not_tried";

/** What a job keeps of one servo in its result. */
export interface Sheet {
  uid: string;
  title: string;
  label: string;
  serial: string | null;
  model: string | null;
  servo_id: number | null;
  node_id: number | null;
  profile: string | null;
  values: Record<string, unknown>;
  held_in: string;
  verdict: string;
  problem: string | null;
}

export interface Unit {
  uid: string;
  verdict: Verdict;
  sheet: Sheet | null;
  steps: readonly JobStep[];
  /** The job that says so. */
  job: Job;
}

/** The units of one job, in its order. */
export function unitsOf(job: Job): Unit[] {
  const kept = (job.result as { units?: Sheet[] } | null)?.units ?? [];
  const sheets = new Map(kept.map(one => [one.uid, one]));
  const uids = new Set([...sheets.keys(), ...job.steps.flatMap(step => (step.uid ? [step.uid] : []))]);
  return [...uids].map(uid => {
    const steps = job.steps.filter(step => step.uid === uid);
    const sheet = sheets.get(uid) ?? null;
    return { uid, sheet, steps, job, verdict: verdictOf(job, sheet, steps) };
  });
}

/** The steps are told at once, the sheet at the end of a unit: what runs or failed now outweighs it. */
function verdictOf(job: Job, sheet: Sheet | null, steps: readonly JobStep[]): Verdict {
  if (steps.some(step => step.state === "running")) return "running";
  if (steps.some(step => step.state === "failed")) return "failed";
  if (sheet?.verdict === "done") return "done";
  if (sheet?.verdict === "failed") return "failed";
  const over = job.state === "succeeded" || job.state === "failed" || job.state === "cancelled";
  if (steps.length > 0 && steps.every(step => step.state === "done" || step.state === "skipped") && !over)
    return "done";
  if (over) return steps.some(step => step.state === "done") ? "failed" : "not_tried";
  return "waiting";
}

/** Every servo once: what runs now comes before what was done, that before what failed, and later before earlier. */
export function merged(jobs: readonly Job[]): Unit[] {
  const found = new Map<string, Unit>();
  for (const unit of jobs.flatMap(unitsOf)) {
    const before = found.get(unit.uid);
    if (!before || WEIGHT[unit.verdict] >= WEIGHT[before.verdict]) found.set(unit.uid, unit);
  }
  return [...found.values()];
}

const WEIGHT: Record<Verdict, number> = { running: 3, done: 2, failed: 1, waiting: 1, not_tried: 0 };

export interface Tally {
  done: number;
  failed: number;
  rest: number;
}

export function tally(units: readonly Unit[]): Tally {
  const done = units.filter(one => one.verdict === "done").length;
  const failed = units.filter(one => one.verdict === "failed").length;
  return { done, failed, rest: units.length - done - failed };
}

/** The name of a step without the place of its unit: "write 2" is "write". */
export function kindOf(step: JobStep): string {
  return step.name.replace(/ \d+$/, "");
}

/** Its sentence without the servo's name, which stands above it. */
export function textOf(step: JobStep): string {
  const at = step.uid ? step.text.indexOf(": ") : -1;
  return at < 0 ? step.text : step.text.slice(at + 2);
}

/** The job to go on with: the newest that can be. */
export function resumableOf(jobs: readonly Job[]): Job | null {
  return jobs.findLast(job => job.resumable) ?? null;
}
