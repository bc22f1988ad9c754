/** Step tests of the servo on the Tune page: the job, its runs, the overlaid runs, the gains. */

import { computed, signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import type { RunOverlay, StepRun, StepTestOptions } from "../api/lab-types";
import type { Job, Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { staged } from "../bench/draft";
import { endText, problemText } from "../bench/facts";
import { decimalsOf, number } from "../bench/format";
import { ended, jobs, setJob, settled } from "../bench/jobs";
import { motion } from "../bench/motion";
import { sheetOf } from "../bench/parameters";
import { apply } from "../change/apply";
import { GAINS, runsInOrder, toggled } from "./step-runs";
import { tune as words } from "./words";

const LISTED = 50;

/** The servo all this belongs to. */
let of = "";

/** Runs without samples, newest first; null until loaded. */
export const runs = signal<readonly StepRun[] | null>(null);
export const runsProblem = signal<string | null>(null);

/** IDs of the overlaid runs, oldest first. */
export const chosenRuns = signal<readonly number[]>([]);
export const overlay = signal<RunOverlay | null>(null);

const job = signal<string | null>(null);
export const test = computed<Job | null>(() => {
  const id = job.value;
  return id === null ? null : (jobs.value.get(id) ?? null);
});
/** Whether the request that starts a test has no response yet. */
const starting = signal(false);
/** True from the press of the button on. */
export const testing = computed(() => starting.value || (test.value !== null && !ended(test.value)));
export const testProblem = signal<string | null>(null);

/** Switch to another servo and discard the state of the last one. */
export async function showServo(uid: string): Promise<void> {
  if (of !== uid) {
    of = uid;
    runs.value = null;
    chosenRuns.value = [];
    overlay.value = null;
    job.value = null;
    testProblem.value = null;
  }
  await loadRuns();
  if (of === uid && chosenRuns.peek().length === 0) {
    const newest = runs.peek()?.[0];
    if (newest) await choose([newest.id]);
  }
}

export async function loadRuns(): Promise<void> {
  const uid = of;
  try {
    const found = await callApi("GET", "/runs", { query: { uid, limit: LISTED } });
    if (of !== uid) return;
    runs.value = found;
    runsProblem.value = null;
    const known = new Set(found.map(run => run.id));
    const left = chosenRuns.peek().filter(id => known.has(id));
    if (left.length !== chosenRuns.peek().length) await choose(left);
  } catch (error) {
    if (of === uid) runsProblem.value = problemText(problemOf(error));
  }
}

let request = 0;

async function choose(ids: readonly number[]): Promise<void> {
  const round = ++request;
  chosenRuns.value = runsInOrder(ids);
  if (ids.length === 0) {
    overlay.value = null;
    return;
  }
  try {
    const found = await callApi("GET", "/runs/overlay", { query: { ids: chosenRuns.peek().join(",") } });
    if (round !== request) return;
    overlay.value = found;
    runsProblem.value = null;
  } catch (error) {
    if (round === request) runsProblem.value = problemText(problemOf(error));
  }
}

export function toggle(id: number): void {
  void choose(toggled(chosenRuns.peek(), id));
}

/** Start a test and wait for its end; the new run is added to those shown. */
export async function startTest(uid: string, options: StepTestOptions): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on" || testing.peek()) return;
  testProblem.value = null;
  try {
    const begun = await begin(uid, options, present.lease);
    if (of !== uid) return;
    const end = await settled(begun.id);
    if (of !== uid || job.peek() !== begun.id) return;
    const made = (end.result as { run?: number } | null)?.run;
    if (end.state !== "succeeded" || made === undefined) {
      testProblem.value = endText(end);
      return;
    }
    await loadRuns();
    await choose(toggled(chosenRuns.peek(), made));
  } catch (error) {
    if (of === uid) testProblem.value = problemText(problemOf(error));
  }
}

/** Send the request; another one cannot be sent before its response. */
async function begin(uid: string, options: StepTestOptions, lease: string): Promise<Job> {
  starting.value = true;
  try {
    const begun = await callApi("POST", "/servos/{uid}/step-test", {
      path: { uid },
      body: options,
      headers: { Lease: lease },
    });
    if (!jobs.peek().has(begun.id)) setJob(begun);
    if (of === uid) job.value = begun.id;
    return begun;
  } finally {
    starting.value = false;
  }
}

/** Apply the staged gains, if any, then run the test. */
export async function applyAndTest(uid: string, options: StepTestOptions): Promise<void> {
  if (testing.peek() || sheetOf(uid).busy.peek() !== null) return;
  testProblem.value = null;
  if (stagedGains(uid).size > 0 && !(await applyGains(uid))) {
    testProblem.value = words.form.notApplied;
    return;
  }
  if (motion.peek().phase === "on") await startTest(uid, options);
  else testProblem.value = words.form.motionEnded;
}

/** Cancel the test; the horn returns to its start position. */
export async function cancelTest(): Promise<void> {
  const present = test.peek();
  if (!present || ended(present)) return;
  try {
    setJob(await callApi("DELETE", "/jobs/{job_id}", { path: { job_id: present.id }, timeout_ms: 30_000 }));
  } catch (error) {
    testProblem.value = problemText(problemOf(error));
  }
}

/** Delete a run. */
export async function dropRun(id: number): Promise<void> {
  await callApi("DELETE", "/runs/{run_id}", { path: { run_id: id } });
  await loadRuns();
}

/** The gains with a valid staged value. */
export function stagedGains(uid: string): Map<string, Value> {
  const sheet = sheetOf(uid);
  const all = staged(sheet.drafts.map.value, key => sheet.held(key));
  return new Map([...all].filter(([key]) => (GAINS as readonly string[]).includes(key)));
}

/** Stage values in the rows. */
export function stageGains(uid: string, values: ReadonlyMap<string, Value>): void {
  const { drafts } = sheetOf(uid);
  for (const [key, value] of values) {
    if (value === null) continue;
    const decimals = decimalsOf(catalog.peek()?.rows.get(key)?.per_unit ?? 1);
    const words = typeof value === "number" ? number(value, decimals) : String(value);
    drafts.put(key, { text: words, verdict: { ok: true, value } });
    drafts.commit(key, sheetOf(uid).held(key));
  }
}

export function discardGains(uid: string): void {
  sheetOf(uid).drafts.drop(GAINS);
}

/** Write only the gains to RAM, under this page's lease; other staged values stay staged. */
export async function applyGains(uid: string): Promise<boolean> {
  const present = motion.peek();
  return apply(sheetOf(uid), {
    only: GAINS,
    headers: present.phase === "on" ? { Lease: present.lease } : {},
  });
}
