/** Server side of the wizard: candidates, wiggles, jobs, and which of them the page shows. */

import { computed, signal } from "@preact/signals";
import { callApi, type Problem, problemOf } from "../api/client";
import type { CommissioningPreview, CommissionPlan, SafetyWord } from "../api/config-types";
import type { Job } from "../api/types";
import { monotonic } from "../bench/clock";
import { openCommissioning } from "../bench/commission-open";
import { all, nameOf, peekServo, pending, servo } from "../bench/fleet";
import { ended, jobs, setJob } from "../bench/jobs";
import { leaseHeader } from "../bench/motion";
import { wholeNumber } from "../bench/number";
import { type Poll, poll } from "../bench/poll";
import { Resource } from "../bench/resource";
import { whyRefused } from "../change/consequences";
import { wordsOf } from "../change/safety-words";
import { changeDraft, chooseServos, draft, propose, request, wanted } from "./draft";

const POLL_MS = 2000;

/** Servos that can be commissioned. */
export const candidates = new Resource(async () => {
  const found = await callApi("GET", "/commissioning/candidates");
  const receivedAt = monotonic();
  pending.value = found.pending.map(one => ({ ...one, receivedAt }));
  return found;
});

export function watchCandidates(): Poll {
  return candidates.watch(POLL_MS);
}

/** Commissioning jobs on the server, oldest first; null until loaded. */
export const known = signal<readonly string[] | null>(null);

/** Load the jobs and show one that is running: it runs in the server. */
export async function loadJobs(): Promise<void> {
  try {
    const found = await callApi("GET", "/jobs", { query: { kind: "commissioning" } });
    for (const job of found) setJob(job);
    known.value = found.map(job => job.id);
    const mine = new Set(draft.peek().jobs);
    const running = found.find(job => !ended(job));
    const gone = [...mine].filter(id => !found.some(job => job.id === id));
    if (running && !mine.has(running.id)) changeDraft({ jobs: [running.id] });
    else if (gone.length > 0) changeDraft({ jobs: [...mine].filter(id => !gone.includes(id)) });
  } catch {
    known.value ??= [];
  }
}

/** The known jobs of the wizard. */
export const mine = computed<Job[]>(() => draft.value.jobs.flatMap(id => jobs.value.get(id) ?? []));
export const jobUnderWay = computed(() => mine.value.find(job => !ended(job)) ?? null);

/** The newest job that is not shown and can be resumed. */
export const unfinishedJob = computed<Job | null>(() => {
  const found = (known.value ?? []).flatMap(id => jobs.value.get(id) ?? []);
  return found.find(job => job.resumable && !draft.value.jobs.includes(job.id)) ?? null;
});

/** Show the job that another page links to. */
export function showOpened(): void {
  const id = openCommissioning.peek();
  openCommissioning.value = null;
  if (id !== null) changeDraft({ jobs: [id] });
}

/** Show a job that was started elsewhere or earlier. */
export function show(job: Job): void {
  setJob(job);
  changeDraft({ jobs: [job.id] });
}

/** Select servos, ordered by serial number. */
export function selectServos(uids: readonly string[]): void {
  const servos = uids.flatMap(uid => {
    const one = peekServo(uid);
    return one ? [{ uid, servoId: one.servo_id, label: one.label, serial: one.serial ?? "" }] : [];
  });
  servos.sort((a, b) => a.serial.localeCompare(b.serial) || a.uid.localeCompare(b.uid));
  changeDraft(chooseServos(draft.peek(), servos, candidates.value.peek()?.servos ?? []));
  suggest(draft.peek().at);
}

/** Servo IDs of servos that are not in the draft, with their names. */
export const owners = computed<ReadonlyMap<number, string>>(() => {
  const chosen = new Set(draft.value.chosen);
  const left = new Set(draft.value.chosen.filter(uid => draft.value.entries[uid]?.state === "skipped"));
  return new Map(
    all.value.flatMap(one =>
      one.servo_id && (!chosen.has(one.uid) || left.has(one.uid))
        ? ([[one.servo_id, nameOf(one)]] as const)
        : [],
    ),
  );
});

/** Fill in the ID of a servo that has none yet. */
export function suggest(uid: string | null): void {
  const entry = uid === null ? undefined : draft.peek().entries[uid];
  if (uid === null || !entry || entry.state === "given") return;
  const taken = new Set(owners.peek().keys());
  if (entry.servoId !== "" && !clashes(uid, entry.servoId)) return;
  changeDraft({
    entries: {
      ...draft.peek().entries,
      [uid]: { ...entry, servoId: propose(draft.peek(), uid, taken) },
    },
  });
}

function clashes(uid: string, id: string): boolean {
  return Object.entries(draft.peek().entries).some(
    ([other, entry]) =>
      other !== uid && entry.state === "given" && wholeNumber(entry.servoId) === wholeNumber(id),
  );
}

/** Assign the next free ID to each open servo, without identifying it. */
export function assignRemaining(): void {
  for (const uid of draft.peek().chosen) {
    if (draft.peek().entries[uid]?.state !== "open") continue;
    suggest(uid);
    const entry = draft.peek().entries[uid];
    if (entry?.servoId)
      changeDraft({ entries: { ...draft.peek().entries, [uid]: { ...entry, state: "given" } } });
  }
  changeDraft({ at: null });
}

export const profiles = new Resource(() => callApi("GET", "/profiles"));

export interface StartRefused {
  text: string;
  uid: string | null;
  /** Confirmations that are missing, if nothing else is; one of them where there are alternatives. */
  confirm: readonly SafetyWord[];
}

export const startRefused = signal<StartRefused | null>(null);
export const starting = signal(false);

function refusal(problem: Problem): StartRefused {
  const { uid } = problem.facts;
  const named = typeof uid === "string" ? uid : null;
  const name = nameOf(servo(named));
  const said = whyRefused(problem);
  return {
    text: name !== "" && !said.includes(name) ? `${name}: ${said}` : said,
    uid: named,
    confirm: wordsOf(problem),
  };
}

async function doing(act: () => Promise<void>): Promise<void> {
  if (starting.peek()) return;
  starting.value = true;
  startRefused.value = null;
  try {
    await act();
  } catch (error) {
    startRefused.value = refusal(problemOf(error));
  } finally {
    starting.value = false;
  }
}

const once = () => ({ "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}` });

/** Planned changes of each servo, by UID; null until the server has checked everything, or if it refuses. */
export const plans = signal<ReadonlyMap<string, CommissionPlan> | null>(null);

/** Let the server check the request and plan the changes. Nothing is written. */
export async function plan(): Promise<void> {
  plans.value = null;
  const body = { ...request(draft.peek()), dry_run: true };
  await doing(async () => {
    const headers = leaseHeader();
    const options = { body, headers, timeout_ms: 60_000 };
    const found = (await callApi("POST", "/commissioning", options)) as CommissioningPreview;
    plans.value = new Map(found.servos.map(one => [one.uid, one]));
  });
}

/** Start the job for all servos of the draft. */
export const start = () =>
  doing(async () => {
    const job = await post(wanted(draft.peek()));
    changeDraft({ jobs: [job.id] });
  });

/** Retry one servo with a new job. */
export const retry = (uid: string) =>
  doing(async () => {
    const job = await post([uid]);
    changeDraft({ jobs: [...draft.peek().jobs, job.id] });
  });

async function post(uids: readonly string[]): Promise<Job> {
  const job = (await callApi("POST", "/commissioning", {
    body: request(draft.peek(), uids),
    headers: { ...leaseHeader(), ...once() },
    timeout_ms: 30_000,
  })) as Job;
  setJob(job);
  return job;
}

/** Resume a job with its remaining servos. */
export const resume = (job: Job) =>
  doing(async () => {
    setJob(
      await callApi("POST", "/jobs/{job_id}/resume", { path: { job_id: job.id }, headers: leaseHeader() }),
    );
  });

export const cancel = (job: Job) =>
  doing(async () => {
    setJob(await callApi("DELETE", "/jobs/{job_id}", { path: { job_id: job.id }, timeout_ms: 30_000 }));
  });

/** Poll the state of the jobs shown, in case a message of the socket was missed. */
export function watchJobs(): Poll {
  return poll(POLL_MS, async () => {
    for (const id of draft.peek().jobs) {
      const present = jobs.peek().get(id);
      if (present && ended(present)) continue;
      await callApi("GET", "/jobs/{job_id}", { path: { job_id: id } }).then(setJob, () => undefined);
    }
  });
}
