/** The step tests of the servo on the Tune page: the job, its runs, those laid over one another, the gains. */

import { computed, signal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { RunOverlay, StepRun, StepTestWish } from "../api/lab-types";
import type { Job, Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { staged } from "../bench/draft";
import { problemText } from "../bench/facts";
import { decimalsOf, number } from "../bench/format";
import { ended, jobs, setJob, settled } from "../bench/jobs";
import { motion } from "../bench/motion";
import { sheetOf } from "../bench/parameters";
import { apply } from "../change/apply";
import { text } from "../text";
import { GAINS, runsInOrder, toggled } from "./step-runs";
import { tune as words } from "./words";

const LISTED = 50;

/** Of which servo all this is. */
let of = "";

/** Newest first, without samples; null until asked. */
export const runs = signal<readonly StepRun[] | null>(null);
export const runsProblem = signal<string | null>(null);

/** The runs laid over one another, oldest first. */
export const chosenRuns = signal<readonly number[]>([]);
export const overlay = signal<RunOverlay | null>(null);

const job = signal<string | null>(null);
export const test = computed<Job | null>(() => {
  const id = job.value;
  return id === null ? null : (jobs.value.get(id) ?? null);
});
/** Whether the request that starts a test is not answered yet. */
const starting = signal(false);
/** From the press on. */
export const testing = computed(() => starting.value || (test.value !== null && !ended(test.value)));
export const testProblem = signal<string | null>(null);

/** Turns to another servo: what was known of the last one goes. */
export async function turnTo(uid: string): Promise<void> {
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
    const found = await ask("GET", "/runs", { query: { uid, limit: LISTED } });
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

let asked = 0;

async function choose(ids: readonly number[]): Promise<void> {
  const round = ++asked;
  chosenRuns.value = runsInOrder(ids);
  if (ids.length === 0) {
    overlay.value = null;
    return;
  }
  try {
    const found = await ask("GET", "/runs/overlay", { query: { ids: chosenRuns.peek().join(",") } });
    if (round !== asked) return;
    overlay.value = found;
    runsProblem.value = null;
  } catch (error) {
    if (round === asked) runsProblem.value = problemText(problemOf(error));
  }
}

export function toggle(id: number): void {
  void choose(toggled(chosenRuns.peek(), id));
}

/** Starts a test and waits for its end; the new run joins those shown. */
export async function startTest(uid: string, wish: StepTestWish): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on" || testing.peek()) return;
  testProblem.value = null;
  try {
    const begun = await begin(uid, wish, present.lease);
    if (of !== uid) return;
    const end = await settled(begun.id);
    if (of !== uid || job.peek() !== begun.id) return;
    const made = (end.result as { run?: number } | null)?.run;
    if (end.state !== "succeeded" || made === undefined) {
      testProblem.value = end.error?.detail ?? text.job.state[end.state];
      return;
    }
    await loadRuns();
    await choose(toggled(chosenRuns.peek(), made));
  } catch (error) {
    if (of === uid) testProblem.value = problemText(problemOf(error));
  }
}

/** Sends the request once: until it is answered nobody can send another. */
async function begin(uid: string, wish: StepTestWish, lease: string): Promise<Job> {
  starting.value = true;
  try {
    const begun = await ask("POST", "/servos/{uid}/step-test", {
      path: { uid },
      body: wish,
      headers: { Lease: lease },
    });
    if (!jobs.peek().has(begun.id)) setJob(begun);
    if (of === uid) job.value = begun.id;
    return begun;
  } finally {
    starting.value = false;
  }
}

/** Applies the staged gains, then runs the test with just them; without staged gains, the test alone. */
export async function applyAndTest(uid: string, wish: StepTestWish): Promise<void> {
  if (testing.peek() || sheetOf(uid).busy.peek() !== null) return;
  testProblem.value = null;
  if (stagedGains(uid).size > 0 && !(await applyGains(uid))) {
    testProblem.value = words.form.notApplied;
    return;
  }
  if (motion.peek().phase === "on") await startTest(uid, wish);
  else testProblem.value = words.form.motionEnded;
}

/** Ends the test; the horn goes back to where it was. */
export async function cancelTest(): Promise<void> {
  const present = test.peek();
  if (!present || ended(present)) return;
  try {
    setJob(await ask("DELETE", "/jobs/{job_id}", { path: { job_id: present.id }, timeout_ms: 30_000 }));
  } catch (error) {
    testProblem.value = problemText(problemOf(error));
  }
}

/** Forgets a run. */
export async function dropRun(id: number): Promise<void> {
  await ask("DELETE", "/runs/{run_id}", { path: { run_id: id } });
  await loadRuns();
}

/** The gains with a legal draft of another value. */
export function stagedGains(uid: string): Map<string, Value> {
  const sheet = sheetOf(uid);
  const all = staged(sheet.drafts.map.value, key => sheet.held(key));
  return new Map([...all].filter(([key]) => (GAINS as readonly string[]).includes(key)));
}

/** Puts values into the rows, to be applied or not. */
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

/** Writes the gains alone to RAM, under the motion control this page holds; other drafts stay drafts. */
export async function applyGains(uid: string): Promise<boolean> {
  const present = motion.peek();
  return apply(sheetOf(uid), {
    only: GAINS,
    headers: present.phase === "on" ? { Lease: present.lease } : {},
  });
}
