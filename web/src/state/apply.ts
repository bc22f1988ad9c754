/** Owns writing: staged edits to RAM in one PATCH, RAM to ROM by a job, and what each row is told of it. */
import { signal } from "@preact/signals";
import { ask, type Problem, problemOf } from "../api/client";
import type { Change, Job, ParametersPatched, Value } from "../api/types";
import { full } from "../form/format";
import { text } from "../text/en";
import { catalog } from "./catalog";
import { staged } from "./draft";
import { peekServo } from "./fleet";
import { jobs, setJob, settled } from "./jobs";
import type { Outcome, Sheet } from "./parameters";

/** The save under way or just ended, for the dialog; `shown` is false once it was hidden. */
export const saving = signal<{ uid: string; job: string; keys: string[]; shown: boolean } | null>(null);

/** A problem of the whole sheet rather than of a row. */
export const sheetProblem = signal<{ uid: string; text: string } | null>(null);

export interface ApplyOptions {
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
  sheet.busy.value = "applying";
  sheet.setOutcomes([...values.keys()].map(key => [key, { kind: "pending" }]));
  try {
    const answer = await ask<ParametersPatched>("PATCH", `/servos/${sheet.uid}/parameters`, {
      body: { values: Object.fromEntries(values) },
      headers: { "If-Match": sheet.revision, ...options.headers },
      timeout_ms: 30_000,
    });
    sheet.revision = answer.revision;
    return take(sheet, answer);
  } catch (error) {
    refuse(sheet, [...values.keys()], problemOf(error));
    return false;
  } finally {
    await sheet.load();
    sheet.busy.value = null;
  }
}

function take(sheet: Sheet, answer: ParametersPatched): boolean {
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

function refuse(sheet: Sheet, keys: string[], problem: Problem): void {
  const named = [problem.facts.key, problem.facts.parameter].find(
    fact => typeof fact === "string" && keys.includes(fact),
  );
  if (problem.code === "stale_revision") {
    sheetProblem.value = { uid: sheet.uid, text: text.rows.staleRevision };
    sheet.setOutcomes(keys.map(key => [key, null]));
    return;
  }
  const what = text.rows.notWritten(text.problem(problem));
  const hit = typeof named === "string" ? [named] : keys;
  sheet.setOutcomes(keys.map(key => [key, hit.includes(key) ? { kind: "failed", what, rest: "" } : null]));
}

/** Writes what is staged, then RAM to ROM. The dialog follows the job; the rows are told when it has ended. */
export async function applyAndSave(sheet: Sheet, keys: string[]): Promise<void> {
  if (!(await apply(sheet))) return;
  sheet.busy.value = "saving";
  try {
    const job = await ask<Job>("POST", `/servos/${sheet.uid}/save`, {
      headers: { "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}` },
    });
    // What the socket told of it meanwhile is newer than this answer.
    if (!jobs.peek().has(job.id)) setJob(job);
    saving.value = { uid: sheet.uid, job: job.id, keys, shown: true };
    const end = await settled(job.id);
    await sheet.load();
    if (end.state === "succeeded") {
      const at = end.ended_at ?? Date.now() / 1000;
      const left = new Set(peekServo(sheet.uid)?.unsaved ?? []);
      sheet.setOutcomes(keys.filter(key => !left.has(key)).map(key => [key, { kind: "saved", at }]));
    } else {
      sheetProblem.value = { uid: sheet.uid, text: end.error?.detail ?? text.job.state[end.state] };
    }
  } catch (error) {
    sheetProblem.value = { uid: sheet.uid, text: text.save.notSaved(text.problem(problemOf(error))) };
  } finally {
    sheet.busy.value = null;
  }
}
