/** The matrix: rows of many servos beside one another, which of them stand out, and what is staged on whom. */

import type { Row, Value } from "../api/types";
import { type Draft, wrong } from "../bench/draft";
import { servo } from "../bench/fleet";
import { type Sheet, sheetOf } from "../bench/parameters";
import { draftFor } from "../change/stage";
import { text } from "../text";

/** The unique ids that the address of a matrix lists; none: every servo on the bus. */
export function uidsIn(listed: string): string[] {
  return [...new Set(listed.split(",").filter(uid => /^[0-9a-f]{32}$/.test(uid)))];
}

export interface HeldValue {
  uid: string;
  model: string | null;
  value: Value | undefined;
  unit: string;
}

/** How a value stands among the servos of its model: apart from most of them, or where no value is most of theirs. */
export type Odd = { kind: "outlier"; usual: Value; unit: string } | { kind: "apart" };

/** Which servos hold something else than most of their model do. A servo alone of its model is compared with nobody. */
export function oddOnes(held: readonly HeldValue[]): ReadonlyMap<string, Odd> {
  const found = new Map<string, Odd>();
  for (const group of grouped(held)) {
    const counts = new Map<string, HeldValue[]>();
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

function grouped(held: readonly HeldValue[]): HeldValue[][] {
  const models = new Map<string, HeldValue[]>();
  for (const one of held) {
    if (one.model === null || one.value === undefined || one.value === null) continue;
    models.set(one.model, [...(models.get(one.model) ?? []), one]);
  }
  return [...models.values()];
}

const same = (one: HeldValue) => `${typeof one.value} ${String(one.value)} ${one.unit}`;

/** Rows every servo has a value of its own in: nobody stands out there, and nothing of them is copied. */
export function isOwn(row: Row): boolean {
  return row.identity;
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

export function wrongOn(uids: readonly string[]): number {
  return uids.reduce((sum, uid) => sum + wrong(sheetOf(uid).drafts.map.value).length, 0);
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

/** What a row that is no number can hold. */
export function optionsOf(row: Row): readonly { key: string; label: string }[] {
  if (row.kind !== "switch") return row.choices;
  return [
    { key: "true", label: text.on },
    { key: "false", label: text.off },
  ];
}
