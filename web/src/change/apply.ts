/** Writing: staged edits to RAM in one PATCH, RAM to ROM by a job, and what each row is told of it. */

import { signal } from "@preact/signals";
import { ask, type Problem, problemOf } from "../api/client";
import type { SafetyWord, SavePreview } from "../api/config-types";
import type { Change, Job, ParametersPatched, Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { staged } from "../bench/draft";
import { endText, failureText, problemText } from "../bench/facts";
import { type KnownServo, peekServo } from "../bench/fleet";
import { full } from "../bench/format";
import { jobs, setJob, settled } from "../bench/jobs";
import type { Outcome, Sheet } from "../bench/parameters";
import { text } from "../text";

/** The save under way or just ended, for the dialog; `shown` is false once it was hidden. */
export const saving = signal<{ uid: string; job: string; keys: string[]; shown: boolean } | null>(null);

/** A problem of the whole sheet rather than of a row. */
export const sheetProblem = signal<{ uid: string; text: string } | null>(null);

/** What the last write of a servo's page changed in RAM, to be written back; gone on the next visit. */
export interface Written {
  at: number;
  /** When the servo had started, on our monotonic clock; null where it did not say. */
  bootAt: number | null;
  changes: readonly Change[];
}

/** An uptime is told in whole seconds, and late. */
const SAME_BOOT_S = 3;

/** Whether the servo has restarted since a write: RAM is then what ROM was. */
export function restartedSince(written: Written, one: KnownServo): boolean {
  if (one.state === "restarting") return true;
  if (!one.online || one.bootAt === null || written.bootAt === null) return false;
  return Math.abs(one.bootAt - written.bootAt) > SAME_BOOT_S;
}

/** What can be taken back of a write: rows that still hold what was written. */
export function undoable(written: Written, sheet: Sheet): readonly Change[] {
  return written.changes.filter(change => sheet.held(change.key) === change.after);
}

export const lastWritten = signal<{ uid: string; written: Written } | null>(null);

/** Asks whoever sits here; null is no. */
export type AskBack = (problem: Problem) => Promise<SafetyWord | null>;

export interface ApplyOptions {
  askBack?: AskBack;

  /** These rows alone; other drafts stay drafts. */
  only?: readonly string[];
  headers?: Record<string, string>;
}

/** Writes the staged values to RAM, all or nothing. Answers whether everything asked for is there. */
export async function apply(sheet: Sheet, options: ApplyOptions = {}): Promise<boolean> {
  sheetProblem.value = null;
  const all = staged(sheet.drafts.map.peek(), key => sheet.held(key));
  const values = new Map([...all].filter(([key]) => options.only?.includes(key) ?? true));
  if (values.size === 0) return true;
  return write(sheet, values, options);
}

/** Writes these values to RAM, all or nothing, staged or not. */
export async function write(
  sheet: Sheet,
  values: ReadonlyMap<string, WantedValue>,
  options: ApplyOptions = {},
): Promise<boolean> {
  sheetProblem.value = null;
  sheet.busy.value = "applying";
  sheet.setOutcomes([...values.keys()].map(key => [key, { kind: "pending" }]));
  try {
    const answer = await patch(sheet, values, options, []);
    sheet.revision = answer.revision;
    const changes = answer.changes.filter(change => change.verdict !== "unchanged" && change.before !== null);
    if (answer.outcome === "applied" && changes.length > 0) {
      const bootAt = peekServo(sheet.uid)?.bootAt ?? null;
      lastWritten.value = { uid: sheet.uid, written: { at: Date.now() / 1000, bootAt, changes } };
    }
    return takeOutcomes(sheet, answer);
  } catch (error) {
    refuse(sheet, [...values.keys()], problemOf(error), options.askBack !== undefined);
    return false;
  } finally {
    await sheet.load();
    sheet.busy.value = null;
  }
}

export type WantedValue = boolean | number | string;

/** Sends it; and again, with one more word, each time somebody agrees to what the server asks back. */
async function patch(
  sheet: Sheet,
  values: ReadonlyMap<string, WantedValue>,
  options: ApplyOptions,
  confirm: readonly SafetyWord[],
): Promise<ParametersPatched> {
  try {
    return await ask<ParametersPatched>("PATCH", `/servos/${sheet.uid}/parameters`, {
      body: { values: Object.fromEntries(values), ...(confirm.length > 0 ? { confirm } : {}) },
      headers: { "If-Match": sheet.revision, ...options.headers },
      timeout_ms: 30_000,
    });
  } catch (error) {
    const problem = problemOf(error);
    const word =
      problem.code === "needs_confirmation" ? await askSomebody(sheet, values, options, problem) : null;
    if (word === null || confirm.includes(word)) throw error;
    return patch(sheet, values, options, [...confirm, word]);
  }
}

/** While somebody thinks about it nothing is being written, and no row says so. */
async function askSomebody(
  sheet: Sheet,
  values: ReadonlyMap<string, WantedValue>,
  options: ApplyOptions,
  problem: Problem,
): Promise<SafetyWord | null> {
  if (!options.askBack) return null;
  const say = (outcome: Outcome | null) => sheet.setOutcomes([...values.keys()].map(key => [key, outcome]));
  say(null);
  sheet.busy.value = null;
  const word = await options.askBack(problem);
  sheet.busy.value = "applying";
  say({ kind: "pending" });
  return word;
}

/** Takes the answer of a write of some rows: drafts that are done go, each row is told. Answers whether all is well. */
export function takeOutcomes(
  sheet: Sheet,
  answer: Pick<ParametersPatched, "outcome" | "changes" | "failure">,
): boolean {
  const culprits = answer.changes.filter(
    change => !WELL.has(change.verdict) && change.verdict !== "rolled_back",
  );
  const outcomes: [string, Outcome | null][] = [];
  const done: string[] = [];
  for (const change of answer.changes) {
    if (WELL.has(change.verdict)) {
      outcomes.push([change.key, null]);
      done.push(change.key);
    } else if (change.verdict === "clamped" && answer.outcome === "applied") {
      outcomes.push([change.key, { kind: "clamped", asked: change.requested }]);
      done.push(change.key);
    } else {
      outcomes.push([change.key, failure(change, culprits, answer.failure ?? null)]);
    }
  }
  sheet.drafts.drop(done);
  sheet.setOutcomes(outcomes);
  return answer.outcome === "applied" && culprits.length === 0;
}

const WELL = new Set<Change["verdict"]>(["applied", "unchanged", "planned"]);

function failure(change: Change, culprits: Change[], why: string | null): Outcome {
  const row = catalog.peek()?.rows.get(change.key);
  const show = (value: Value) => (row ? full(value, { ...row, perUnit: row.per_unit }) : String(value));
  const holds = text.rows.ramHolds(show(change.before));
  if (change.verdict === "rolled_back") {
    const others = culprits.map(one => catalog.peek()?.rows.get(one.key)?.label ?? one.key).join(", ");
    return { kind: "failed", what: text.rows.rolledBack(others), rest: holds };
  }
  const reason = why ?? text.rows.verdict[change.verdict] ?? change.verdict;
  return { kind: "failed", what: text.rows.notWritten(reason), rest: holds };
}

/** Tells rows that nothing was written, and why: the row the problem names, or all of them. */
export function refuse(sheet: Sheet, keys: string[], problem: Problem, declined = false): void {
  const named = [problem.facts.key, problem.facts.parameter].find(
    fact => typeof fact === "string" && keys.includes(fact),
  );
  // Whoever was asked said no: it stays staged, and nothing is wrong with it.
  if (problem.code === "needs_confirmation" && declined) {
    sheet.setOutcomes(keys.map(key => [key, null]));
    return;
  }
  if (problem.code === "stale_revision") {
    sheetProblem.value = { uid: sheet.uid, text: text.rows.staleRevision };
    sheet.setOutcomes(keys.map(key => [key, null]));
    return;
  }
  const what = text.rows.notWritten(problemText(problem));
  const hit = typeof named === "string" ? [named] : keys;
  sheet.setOutcomes(keys.map(key => [key, hit.includes(key) ? { kind: "failed", what, rest: "" } : null]));
}

/** Starts the save of a servo, and once only, however often the request is sent. Throws what the server answers. */
export function startSave(uid: string, confirm: readonly SafetyWord[]): Promise<Job> {
  const headers = { "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}` };
  return ask<Job>("POST", `/servos/${uid}/save`, { body: { confirm }, headers });
}

/** What a save of RAM, or of RAM with what is staged, would do. Nothing is written; refused as the save itself is. */
export function planSave(sheet: Sheet, confirm: readonly SafetyWord[]): Promise<SavePreview> {
  const values = stagedIn(sheet);
  if (values.size === 0) {
    return ask<SavePreview>("POST", `/servos/${sheet.uid}/save`, { body: { confirm, dry_run: true } });
  }
  return patchAndSave(sheet, values, confirm, true);
}

/** Writes what is staged and saves, as one request. The dialog follows the job; the rows are told when it has ended. */
export async function applyAndSave(
  sheet: Sheet,
  keys: readonly string[],
  confirm: readonly SafetyWord[],
): Promise<void> {
  const values = stagedIn(sheet);
  sheetProblem.value = null;
  sheet.busy.value = values.size > 0 ? "applying" : "saving";
  try {
    const job = await (values.size > 0
      ? writeAndSave(sheet, values, confirm)
      : startSave(sheet.uid, confirm).then(begun => {
          // What the socket told of it meanwhile is newer than this answer.
          if (!jobs.peek().has(begun.id)) setJob(begun);
          return begun.id;
        }));
    if (job === null) return;
    sheet.busy.value = "saving";
    saving.value = { uid: sheet.uid, job, keys: [...keys], shown: true };
    await followSave(sheet, job, keys);
  } catch (error) {
    refuse(sheet, [...values.keys()], problemOf(error));
    if (sheetProblem.peek() === null) {
      sheetProblem.value = { uid: sheet.uid, text: text.save.notSaved(problemText(problemOf(error))) };
    }
    await sheet.load();
  } finally {
    sheet.busy.value = null;
  }
}

const stagedIn = (sheet: Sheet) => staged(sheet.drafts.map.peek(), key => sheet.held(key));

function patchAndSave(
  sheet: Sheet,
  values: ReadonlyMap<string, WantedValue>,
  confirm: readonly SafetyWord[],
  dryRun: boolean,
): Promise<ParametersPatched> {
  return ask<ParametersPatched>("PATCH", `/servos/${sheet.uid}/parameters`, {
    body: { values: Object.fromEntries(values), confirm, save: true, ...(dryRun ? { dry_run: true } : {}) },
    headers: { "If-Match": sheet.revision },
    timeout_ms: 30_000,
  });
}

/** The job that saves; null when the values were not written, which the rows say. */
async function writeAndSave(
  sheet: Sheet,
  values: ReadonlyMap<string, WantedValue>,
  confirm: readonly SafetyWord[],
): Promise<string | null> {
  sheet.setOutcomes([...values.keys()].map(key => [key, { kind: "pending" }]));
  const answer = await patchAndSave(sheet, values, confirm, false);
  sheet.revision = answer.revision;
  takeOutcomes(sheet, answer);
  if (answer.outcome === "applied" && answer.job) return answer.job;
  await sheet.load();
  if (answer.outcome === "applied") {
    sheetProblem.value = {
      uid: sheet.uid,
      text: text.save.notSaved(answer.problem ? failureText(answer.problem) : ""),
    };
  }
  return null;
}

async function followSave(sheet: Sheet, job: string, keys: readonly string[]): Promise<void> {
  const end = await settled(job);
  await sheet.load();
  if (end.state === "succeeded") {
    const at = end.ended_at ?? Date.now() / 1000;
    const left = new Set(peekServo(sheet.uid)?.unsaved ?? []);
    sheet.setOutcomes(keys.filter(key => !left.has(key)).map(key => [key, { kind: "saved", at }]));
  } else {
    sheetProblem.value = { uid: sheet.uid, text: endText(end) };
  }
}
