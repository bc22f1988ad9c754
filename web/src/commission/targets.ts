/** State of each servo in the commissioning jobs: steps, verdict, and location of its values. No elements. */
import type { Job, JobStep, ProblemBody, Reading, Servo } from "../api/types";

export type TargetVerdict = "waiting" | "running" | "done" | "failed" | "not_tried";

/** Entry of one servo in the result of a job. */
export interface TargetRecord {
  uid: string;
  title: string;
  label: string;
  serial: string | null;
  model: string | null;
  servo_id: number | null;
  node_id: number | null;
  profile: string | null;
  values: Record<string, unknown>;
  verified_in: string;
  verdict: string;
  problem: Pick<ProblemBody, "code" | "summary"> | null;
}

export interface Target {
  uid: string;
  verdict: TargetVerdict;
  record: TargetRecord | null;
  steps: readonly JobStep[];
  /** The job it is from. */
  job: Job;
}

/** The servos of one job, in its order. */
export function targetsOf(job: Job): Target[] {
  const kept = (job.result as { servos?: TargetRecord[] } | null)?.servos ?? [];
  const records = new Map(kept.map(one => [one.uid, one]));
  const uids = new Set([...records.keys(), ...job.steps.flatMap(step => (step.uid ? [step.uid] : []))]);
  return [...uids].map(uid => {
    const steps = job.steps.filter(step => step.uid === uid);
    const record = records.get(uid) ?? null;
    return { uid, record, steps, job, verdict: verdictOf(job, record, steps) };
  });
}

/** Steps are reported immediately, the result entry at the end: a running or failed step takes precedence. */
function verdictOf(job: Job, record: TargetRecord | null, steps: readonly JobStep[]): TargetVerdict {
  if (steps.some(step => step.state === "running")) return "running";
  if (steps.some(step => step.state === "failed")) return "failed";
  if (record?.verdict === "done") return "done";
  if (record?.verdict === "failed") return "failed";
  const over = job.state === "succeeded" || job.state === "failed" || job.state === "cancelled";
  if (steps.length > 0 && steps.every(step => step.state === "done" || step.state === "skipped") && !over)
    return "done";
  if (over) return steps.some(step => step.state === "done") ? "failed" : "not_tried";
  return "waiting";
}

/** Every servo once: running takes precedence over done, done over failed, and later over earlier. */
export function merged(jobs: readonly Job[]): Target[] {
  const found = new Map<string, Target>();
  for (const target of jobs.flatMap(targetsOf)) {
    const before = found.get(target.uid);
    if (!before || WEIGHT[target.verdict] >= WEIGHT[before.verdict]) found.set(target.uid, target);
  }
  return [...found.values()];
}

const WEIGHT: Record<TargetVerdict, number> = { running: 3, done: 2, failed: 1, waiting: 1, not_tried: 0 };

/** Location of the values of a completed servo; `lost`: neither RAM nor ROM has all of them. */
export type ValuesPlace = "rom" | "ram" | "lost";

/** From the job, and after it from the servo's known values. */
export function valuesPlaceOf(
  target: Target,
  servo: Pick<Servo, "lost"> | undefined,
  reading: (key: string) => Pick<Reading, "rom" | "value"> | undefined,
): ValuesPlace {
  const { record } = target;
  if (!record)
    return target.steps.some(step => step.code === "save" && step.state === "done") ? "rom" : "ram";
  if (record.verified_in === "rom") return "rom";
  // Torque is switched by motion, so it is not a value of this job.
  const values = Object.entries(record.values).filter(([key]) => key !== "torque_mode");
  if (values.length > 0 && values.every(([key, value]) => reading(key)?.rom === value)) return "rom";
  const gone = servo?.lost?.some(one => one.key in record.values) ?? false;
  return gone || values.some(([key, value]) => (reading(key)?.value ?? value) !== value) ? "lost" : "ram";
}

export interface Tally {
  /** Values in ROM. */
  done: number;
  /** Done as requested, but not in ROM. */
  ram: number;
  lost: number;
  failed: number;
  rest: number;
}

export function tally(targets: readonly Target[], place: (target: Target) => ValuesPlace): Tally {
  const sums: Tally = { done: 0, ram: 0, lost: 0, failed: 0, rest: 0 };
  for (const one of targets) {
    if (one.verdict === "failed") sums.failed++;
    else if (one.verdict !== "done") sums.rest++;
    else sums[PLACES[place(one)]]++;
  }
  return sums;
}

const PLACES = { rom: "done", ram: "ram", lost: "lost" } as const;

/** The newest job that can be resumed. */
export function resumableOf(jobs: readonly Job[]): Job | null {
  return jobs.findLast(job => job.resumable) ?? null;
}
