/** The matrix: rows of many servos beside one another, which of them stand out, and what is staged on whom. */

import { ask, type Problem, problemOf } from "../api/client";
import type { BatchOutcome, BatchPatched, SafetyWord, SavePreview } from "../api/config-types";
import type { Change, Job, ProblemBody, Row, Value } from "../api/types";
import { type Draft, staged, wrong } from "../bench/draft";
import { failureText } from "../bench/facts";
import { servo } from "../bench/fleet";
import { decimalsOf, number } from "../bench/format";
import { settled } from "../bench/jobs";
import { check, checkValue } from "../bench/number";
import { asProblem, type Sheet, sheetOf } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { refuse, take, type Wanted } from "../change/apply";

/** The unique ids that the address of a matrix lists; none: every servo on the bus. */
export function uidsIn(listed: string): string[] {
  return [...new Set(listed.split(",").filter(uid => /^[0-9a-f]{32}$/.test(uid)))];
}

function asBody({ code, status, message, facts }: Problem): ProblemBody {
  return { ...facts, type: "", title: "", code, status, detail: message } as ProblemBody;
}

export interface Held {
  uid: string;
  model: string | null;
  value: Value | undefined;
  unit: string;
}

/** How a value stands among the servos of its model: apart from most of them, or where no value is most of theirs. */
export type Odd = { kind: "outlier"; usual: Value; unit: string } | { kind: "apart" };

/** Which servos hold something else than most of their model do. A servo alone of its model is compared with nobody. */
export function oddOnes(held: readonly Held[]): ReadonlyMap<string, Odd> {
  const found = new Map<string, Odd>();
  for (const group of grouped(held)) {
    const counts = new Map<string, Held[]>();
    for (const one of group) counts.set(same(one), [...(counts.get(same(one)) ?? []), one]);
    if (counts.size < 2) continue;
    const most = [...counts.values()].sort((a, b) => b.length - a.length)[0] ?? [];
    const usual = most[0];
    const clear = usual !== undefined && most.length * 2 > group.length;
    for (const one of group) {
      if (!clear) found.set(one.uid, { kind: "apart" });
      else if (same(one) !== same(usual)) {
        found.set(one.uid, { kind: "outlier", usual: usual.value ?? null, unit: usual.unit });
      }
    }
  }
  return found;
}

function grouped(held: readonly Held[]): Held[][] {
  const models = new Map<string, Held[]>();
  for (const one of held) {
    if (one.model === null || one.value === undefined || one.value === null) continue;
    models.set(one.model, [...(models.get(one.model) ?? []), one]);
  }
  return [...models.values()];
}

const same = (one: Held) => `${typeof one.value} ${String(one.value)} ${one.unit}`;

/** Rows every servo has a value of its own in: nobody stands out there, and nothing of them is copied. */
export function isOwn(row: Row): boolean {
  return row.identity;
}

/** What `value` becomes on this servo: a draft, or the reason why not. */
export function draftFor(sheet: Sheet, row: Row, value: Wanted): Draft | { why: string } {
  const has = sheet.keys.peek();
  if (has !== null && !has.includes(row.key)) return { why: "" };
  if (typeof value !== "number") return { text: String(value), verdict: { ok: true, value } };
  const span = spanOf(row, sheet.reading(row.key).peek());
  const verdict = checkValue(value, span);
  return verdict.ok ? { text: number(value, decimalsOf(span.perUnit)), verdict } : { why: verdict.what };
}

/** The number in what was typed, by the unit of this servo's row; null while it is none. */
export function numberFor(sheet: Sheet, row: Row, typed: string): number | null {
  const { unit, perUnit } = spanOf(row, sheet.reading(row.key).peek());
  const verdict = check(typed, { unit, perUnit, minimum: null, maximum: null });
  return verdict.ok ? verdict.value : null;
}

/** Stages a value; one that RAM holds already takes the draft away. */
export function stage(sheet: Sheet, key: string, draft: Draft): void {
  sheet.setOutcomes([[key, null]]);
  sheet.drafts.put(key, draft);
  sheet.drafts.commit(key, sheet.held(key));
}

/** Rows of `from` that `to` holds otherwise: what may be staged, and how many may not. */
export function copyOf(
  from: Sheet,
  to: Sheet,
  rows: readonly Row[],
): { drafts: Map<string, Draft>; left: number } {
  const drafts = new Map<string, Draft>();
  let left = 0;
  for (const row of rows) {
    if (isOwn(row) || row.expert || row.key === "torque_mode") continue;
    const value = from.held(row.key);
    if (value === undefined || value === null || value === to.held(row.key)) continue;
    const other = from.reading(row.key).peek()?.unit !== to.reading(row.key).peek()?.unit;
    const draft = draftFor(to, row, value);
    if (other || "why" in draft) left += 1;
    else drafts.set(row.key, draft);
  }
  return { drafts, left };
}

/** What is staged and may be sent, by servo; servos with nothing are left out. */
export function stagedOn(uids: readonly string[]): Map<string, Map<string, Wanted>> {
  const found = new Map<string, Map<string, Wanted>>();
  for (const uid of uids) {
    const sheet = sheetOf(uid);
    const values = staged(sheet.drafts.map.value, key => sheet.held(key));
    if (values.size > 0) found.set(uid, values);
  }
  return found;
}

export function wrongOn(uids: readonly string[]): number {
  return uids.reduce((sum, uid) => sum + wrong(sheetOf(uid).drafts.map.value).length, 0);
}

export interface Wish {
  dry_run: boolean;
  save: boolean;
  confirm: readonly SafetyWord[];
}

/** Asks what would become of it, or does it. Each servo is changed all or nothing. */
export async function writeMatrix(
  values: ReadonlyMap<string, ReadonlyMap<string, Wanted>>,
  wish: Wish,
): Promise<BatchOutcome[]> {
  const uids = [...values.keys()];
  const answer = await ask<BatchPatched>("PATCH", "/parameters", {
    body: {
      servos: Object.fromEntries([...values].map(([uid, one]) => [uid, Object.fromEntries(one)])),
      revisions: Object.fromEntries(uids.map(uid => [uid, sheetOf(uid).revision])),
      ...wish,
    },
    timeout_ms: 90_000,
  });
  if (!wish.dry_run) for (const one of answer.servos) tell(one, values);
  return answer.servos;
}

/** What a save of RAM would do on each of these servos; one that is refused says why. Nothing is written. */
export function planSaves(uids: readonly string[], confirm: readonly SafetyWord[]): Promise<BatchOutcome[]> {
  return Promise.all(
    uids.map(async (uid): Promise<BatchOutcome> => {
      const none = { uid, changes: [], revision: null };
      try {
        const body = { confirm, dry_run: true };
        const plan = await ask<SavePreview>("POST", `/servos/${uid}/save`, { body, timeout_ms: 30_000 });
        return { ...none, ...plan, outcome: "planned" };
      } catch (error) {
        return { ...none, outcome: "rejected", problem: asBody(problemOf(error)) };
      }
    }),
  );
}

/** Tells a servo's rows what became of them. */
function tell(one: BatchOutcome, values: ReadonlyMap<string, ReadonlyMap<string, Wanted>>): void {
  const sheet = sheetOf(one.uid);
  if (one.revision) sheet.revision = one.revision;
  if (one.outcome === "applied" || one.outcome === "rolled_back") {
    take(sheet, {
      outcome: one.outcome,
      changes: one.changes,
      failure: one.problem ? failureText(one.problem) : null,
    });
  } else if (one.problem) {
    refuse(sheet, [...(values.get(one.uid)?.keys() ?? [])], asProblem(one.problem));
  }
}

export function changed(changes: readonly Change[]): Change[] {
  return changes.filter(one => one.verdict !== "unchanged");
}

/** Waits for a servo's save, and marks the rows it put into ROM. Answers the job as it ended. */
export async function endOfSave(uid: string, job: string, keys: readonly string[]): Promise<Job> {
  const end = await settled(job);
  const at = end.ended_at ?? Date.now() / 1000;
  if (end.state === "succeeded") sheetOf(uid).setOutcomes(keys.map(key => [key, { kind: "saved", at }]));
  return end;
}

/** Who stands out in a row, from what is known now. */
export function oddRow(row: Row, uids: readonly string[]): ReadonlyMap<string, Odd> {
  if (isOwn(row)) return NOBODY;
  return oddOnes(
    uids.map(uid => ({
      uid,
      model: servo(uid)?.model ?? null,
      value: sheetOf(uid).held(row.key),
      unit: sheetOf(uid).reading(row.key).value?.unit ?? "",
    })),
  );
}

const NOBODY: ReadonlyMap<string, Odd> = new Map();
