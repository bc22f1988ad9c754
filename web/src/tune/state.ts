/** State of the Tune page of one servo: the running measurement, its runs, the shown ones, the gains. */

import { computed, effect, signal, untracked } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import type {
  FrequencyResponse,
  FrequencyTestOptions,
  ImproveOptions,
  ImprovePreview,
  Mechanics,
  MechanicsOptions,
  Plant,
  RunOverlay,
  SetUp,
  StepRun,
  StepTestOptions,
  Tuning,
} from "../api/lab-types";
import type { Job, Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { staged } from "../bench/draft";
import { endText, problemText } from "../bench/facts";
import { decimalsOf, number } from "../bench/format";
import { ended, jobs, setJob } from "../bench/jobs";
import { leaseFor, motion } from "../bench/motion";
import { sheetOf } from "../bench/parameters";
import { apply } from "../change/apply";
import { GAINS, runsInOrder, shownFirst, toggled, withNewest } from "./step-runs";
import { tune as words } from "./words";

const LISTED = 50;

/** Jobs that this page starts, follows and shows in its column. */
const KINDS: ReadonlySet<Job["kind"]> = new Set(["step_test", "frequency_response", "mechanics", "improve"]);

/** The servo all this belongs to. */
const current = signal("");

/** Runs without samples, newest first; null until loaded. */
export const runs = signal<readonly StepRun[] | null>(null);
export const runsProblem = signal<string | null>(null);

/** IDs of the overlaid runs, oldest first. */
export const chosenRuns = signal<readonly number[]>([]);
export const overlay = signal<RunOverlay | null>(null);

/** Frequency responses with their curves, newest first; null until loaded. */
export const responses = signal<readonly FrequencyResponse[] | null>(null);

/** Set-up of the servo; null until loaded. */
export const setUp = signal<SetUp | null>(null);

/** Measured mechanics of the servo; null until loaded. */
export const mechanics = signal<Mechanics | null>(null);

/** What the server can compute; null until loaded. */
export const tuning = signal<Tuning | null>(null);

/** The job shown in the column: running, or ended and not closed yet. */
const followed = signal<string | null>(null);
export const test = computed<Job | null>(() => {
  const id = followed.value;
  return id === null ? null : (jobs.value.get(id) ?? null);
});
/** The request that starts a job has no response yet. */
const starting = signal(false);
/** True from the press of the button on. */
export const testing = computed(() => starting.value || (test.value !== null && !ended(test.value)));
/** Why a test did not start, or what a cancellation was refused for. */
export const testProblem = signal<string | null>(null);

// Jobs of other clients and of before a reload are followed like our own; a job of a set is followed as a whole.
effect(() => {
  const uid = current.value;
  const present = test.value;
  if (uid === "" || (present !== null && !ended(present))) return;
  for (const job of jobs.value.values())
    if (job.uid === uid && KINDS.has(job.kind) && !ended(job)) followed.value = job.id;
});

let concluded: string | null = null;
effect(() => {
  const job = test.value;
  if (job === null || !ended(job) || concluded === job.id) return;
  concluded = job.id;
  untracked(() => void conclude(job));
});

interface Measured {
  run?: number;
  runs?: number[];
}

/** Show what a job measured. */
async function conclude(job: Job): Promise<void> {
  // The verdict says how a measurement went; a change of the servo is reported until it is closed.
  const measured = job.kind !== "improve";
  if (measured && job.state === "succeeded" && followed.peek() === job.id) followed.value = null;
  const uid = current.peek();
  // The result of a set has those of its servos.
  const whole = job.result as ({ results?: Record<string, Measured> } & Measured) | null;
  const made = whole?.results?.[uid] ?? whole ?? {};
  if (job.kind === "frequency_response") await loadResponses();
  if (job.kind === "mechanics") await loadMechanics();
  if (job.kind !== "step_test" && job.kind !== "improve") return;
  await loadRuns();
  const known = new Set(runs.peek()?.map(run => run.id));
  const fresh = [...(made.runs ?? []), ...(made.run === undefined ? [] : [made.run])].filter(id =>
    known.has(id),
  );
  if (uid !== current.peek() || fresh.length === 0) return;
  await choose(fresh.length > 1 ? fresh.slice(-2) : withNewest(chosenRuns.peek(), fresh[0] ?? 0));
}

/** Close the report of the ended job. */
export function dismissJob(): void {
  if (!testing.peek()) followed.value = null;
  testProblem.value = null;
}

/** Switch to another servo and discard the state of the last one. */
export async function showServo(uid: string): Promise<void> {
  if (current.peek() !== uid) {
    followed.value = null;
    runs.value = null;
    responses.value = null;
    setUp.value = null;
    mechanics.value = null;
    chosenRuns.value = [];
    overlay.value = null;
    testProblem.value = null;
    current.value = uid;
  }
  await Promise.all([loadSetUp(), loadResponses(), loadMechanics(), loadRuns()]);
  if (current.peek() === uid && chosenRuns.peek().length === 0) {
    const first = shownFirst(runs.peek() ?? []);
    if (first.length > 0) await choose(first);
  }
}

export async function loadRuns(): Promise<void> {
  const uid = current.peek();
  try {
    const found = await callApi("GET", "/runs", { query: { uid, limit: LISTED } });
    if (current.peek() !== uid) return;
    runs.value = found;
    runsProblem.value = null;
    const known = new Set(found.map(run => run.id));
    const left = chosenRuns.peek().filter(id => known.has(id));
    if (left.length !== chosenRuns.peek().length) await choose(left);
  } catch (error) {
    if (current.peek() === uid) runsProblem.value = problemText(problemOf(error));
  }
}

/** How many responses are loaded with their curves; only those that belong to shown runs are drawn. */
const CURVES = 8;

async function loadResponses(): Promise<void> {
  const uid = current.peek();
  try {
    const found = await callApi("GET", "/frequency-responses", { query: { uid, limit: CURVES } });
    const whole = await Promise.all(
      found.map(one => callApi("GET", "/frequency-responses/{run_id}", { path: { run_id: one.id } })),
    );
    if (current.peek() === uid) responses.value = whole;
  } catch (error) {
    if (current.peek() === uid) runsProblem.value = problemText(problemOf(error));
  }
}

async function loadMechanics(): Promise<void> {
  const uid = current.peek();
  try {
    const found = await callApi("GET", "/servos/{uid}/mechanics", { path: { uid } });
    if (current.peek() === uid) mechanics.value = found;
  } catch (error) {
    if (current.peek() === uid) runsProblem.value = problemText(problemOf(error));
  }
}

async function loadSetUp(): Promise<void> {
  const uid = current.peek();
  try {
    const [found, able] = await Promise.all([
      callApi("GET", "/servos/{uid}/set-up", { path: { uid } }),
      callApi("GET", "/tuning"),
    ]);
    tuning.value = able;
    if (current.peek() === uid) setUp.value = found;
  } catch (error) {
    if (current.peek() === uid) runsProblem.value = problemText(problemOf(error));
  }
}

/** Store the set-up: runs from now on are made with it. Throws on failure. */
export async function storeSetUp(uid: string, body: SetUp): Promise<void> {
  const stored = await callApi("PUT", "/servos/{uid}/set-up", { path: { uid }, body });
  if (current.peek() === uid) setUp.value = stored;
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

/** Start a job; another one cannot be started before the response. Throws on failure. */
async function startMeasurement(
  uid: string,
  send: (lease: string) => Promise<Job>,
  others: readonly string[] = [],
): Promise<void> {
  if (testing.peek()) return;
  starting.value = true;
  testProblem.value = null;
  try {
    const begun = await send(await leaseFor(uid, others));
    if (!jobs.peek().has(begun.id)) setJob(begun);
    if (current.peek() === uid) followed.value = begun.id;
  } finally {
    starting.value = false;
  }
}

/** Apply the staged gains, if any, then run the step. Motion is enabled first. Throws on failure. */
export async function startStep(uid: string, body: StepTestOptions): Promise<void> {
  await startMeasurement(uid, async lease => {
    if (stagedGains(uid).size > 0) {
      if (!(await applyGains(uid))) throw new Error(words.step.notApplied);
      if (motion.peek().phase !== "on") throw new Error(words.step.motionEnded);
    }
    return callApi("POST", "/servos/{uid}/step-test", { path: { uid }, body, headers: { Lease: lease } });
  });
}

export function startResponse(uid: string, body: FrequencyTestOptions): Promise<void> {
  return startMeasurement(uid, lease =>
    callApi("POST", "/servos/{uid}/frequency-response", { path: { uid }, body, headers: { Lease: lease } }),
  );
}

export function startMechanics(uid: string, body: MechanicsOptions): Promise<void> {
  return startMeasurement(uid, lease =>
    callApi("POST", "/servos/{uid}/mechanics", { path: { uid }, body, headers: { Lease: lease } }),
  );
}

/** Give a simulated servo the constants of a twin, as exported. Throws on failure. */
export async function loadTwin(uid: string, file: string): Promise<void> {
  const twin = JSON.parse(file) as { plant?: Plant };
  await callApi("PATCH", "/sim/servos/{uid}", { path: { uid }, body: { plant: twin.plant ?? null } });
}

/** What Improve would move and write, read from the servo. Throws why it cannot. */
export function planImprove(uid: string, body: ImproveOptions): Promise<ImprovePreview> {
  return callApi("POST", "/servos/{uid}/improve/plan", { path: { uid }, body });
}

/** Improve this servo, and then `others` in the same way. */
export function startImprove(
  uid: string,
  body: ImproveOptions,
  others: readonly string[] = [],
): Promise<void> {
  return startMeasurement(
    uid,
    lease => {
      const headers = { Lease: lease };
      return others.length === 0
        ? callApi("POST", "/servos/{uid}/improve", { path: { uid }, body, headers })
        : callApi("POST", "/improve", { body: { ...body, uids: [uid, ...others] }, headers });
    },
    others,
  );
}

/** As `startStep`, from a button outside a dialog: the reason of a failure is shown in the column. */
export async function runAgain(uid: string, options: StepTestOptions): Promise<void> {
  if (sheetOf(uid).busy.peek() !== null) return;
  try {
    await startStep(uid, options);
  } catch (error) {
    testProblem.value = problemText(problemOf(error));
  }
}

/** Cancel the job; it restores what it changed. */
export async function cancelTest(): Promise<void> {
  const present = test.peek();
  if (!present || ended(present)) return;
  try {
    setJob(await callApi("DELETE", "/jobs/{job_id}", { path: { job_id: present.id }, timeout_ms: 30_000 }));
  } catch (error) {
    testProblem.value = problemText(problemOf(error));
  }
}

/** Why the ended job did not succeed; null if it did. */
export function failureOf(job: Job): string | null {
  return ended(job) && job.state !== "succeeded" ? endText(job) : null;
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

/** Stage values in the rows, and write them to RAM. */
export async function restoreGains(uid: string, values: ReadonlyMap<string, Value>): Promise<boolean> {
  const { drafts } = sheetOf(uid);
  for (const [key, value] of values) {
    if (value === null) continue;
    const decimals = decimalsOf(catalog.peek()?.rows.get(key)?.per_unit ?? 1);
    const words = typeof value === "number" ? number(value, decimals) : String(value);
    drafts.put(key, { text: words, verdict: { ok: true, value } });
    drafts.commit(key, sheetOf(uid).held(key));
  }
  return applyGains(uid);
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
