/** What the jobs of commissioning say of each servo: its steps, its verdict, and what to do. No elements. */
import type { Job, JobStep, ProblemBody, Reading, Servo } from "../api/types";

export type UnitVerdict = "waiting" | "running" | "done" | "failed" | "not_tried";

/** What a job keeps of one servo in its result. */
export interface UnitSheet {
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

export interface Unit {
  uid: string;
  verdict: UnitVerdict;
  sheet: UnitSheet | null;
  steps: readonly JobStep[];
  /** The job that says so. */
  job: Job;
}

/** The units of one job, in its order. */
export function unitsOf(job: Job): Unit[] {
  const kept = (job.result as { servos?: UnitSheet[] } | null)?.servos ?? [];
  const sheets = new Map(kept.map(one => [one.uid, one]));
  const uids = new Set([...sheets.keys(), ...job.steps.flatMap(step => (step.uid ? [step.uid] : []))]);
  return [...uids].map(uid => {
    const steps = job.steps.filter(step => step.uid === uid);
    const sheet = sheets.get(uid) ?? null;
    return { uid, sheet, steps, job, verdict: verdictOf(job, sheet, steps) };
  });
}

/** The steps are told at once, the sheet at the end of a unit: what runs or failed now outweighs it. */
function verdictOf(job: Job, sheet: UnitSheet | null, steps: readonly JobStep[]): UnitVerdict {
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

const WEIGHT: Record<UnitVerdict, number> = { running: 3, done: 2, failed: 1, waiting: 1, not_tried: 0 };

/** Where the values of a unit that is done are now; `lost`: neither RAM nor ROM holds all of them. */
export type ValuesPlace = "rom" | "ram" | "lost";

/** Judged by the job, and after it by what the servo is known to hold. */
export function valuesPlaceOf(
  unit: Unit,
  servo: Pick<Servo, "lost"> | undefined,
  reading: (key: string) => Pick<Reading, "rom" | "value"> | undefined,
): ValuesPlace {
  const { sheet } = unit;
  if (!sheet) return unit.steps.some(step => step.code === "save" && step.state === "done") ? "rom" : "ram";
  if (sheet.verified_in === "rom") return "rom";
  // Torque is switched by whoever moves the servo: no value of this job.
  const values = Object.entries(sheet.values).filter(([key]) => key !== "torque_mode");
  if (values.length > 0 && values.every(([key, value]) => reading(key)?.rom === value)) return "rom";
  const gone = servo?.lost?.some(one => one.key in sheet.values) ?? false;
  return gone || values.some(([key, value]) => (reading(key)?.value ?? value) !== value) ? "lost" : "ram";
}

export interface Tally {
  /** In ROM. */
  done: number;
  /** Done as far as it was asked for, and not in ROM. */
  ram: number;
  lost: number;
  failed: number;
  rest: number;
}

export function tally(units: readonly Unit[], place: (unit: Unit) => ValuesPlace): Tally {
  const sums: Tally = { done: 0, ram: 0, lost: 0, failed: 0, rest: 0 };
  for (const one of units) {
    if (one.verdict === "failed") sums.failed++;
    else if (one.verdict !== "done") sums.rest++;
    else sums[PLACES[place(one)]]++;
  }
  return sums;
}

const PLACES = { rom: "done", ram: "ram", lost: "lost" } as const;

/** The job to go on with: the newest that can be. */
export function resumableOf(jobs: readonly Job[]): Job | null {
  return jobs.findLast(job => job.resumable) ?? null;
}
