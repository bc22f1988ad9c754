/** The matrix: rows of many servos, their outliers, and staged values. */

import type { Row, Value } from "../api/types";
import { type Draft, wrong } from "../bench/draft";
import { servo } from "../bench/fleet";
import { type Sheet, sheetOf } from "../bench/parameters";
import { draftFor } from "../change/stage";
import { text } from "../text";

/** UIDs listed in the address of a matrix; none means all servos on the bus. */
export function uidsIn(listed: string): string[] {
  return [...new Set(listed.split(",").filter(uid => /^[0-9a-f]{32}$/.test(uid)))];
}

export interface HeldValue {
  uid: string;
  model: string | null;
  value: Value | undefined;
  unit: string;
}

/** A value compared with the servos of its model: an outlier, or in a row without a majority. */
export type Outlier = { kind: "outlier"; usual: Value; unit: string } | { kind: "apart" };

/** Servos whose value differs from the majority of their model. A servo alone of its model is not compared. */
export function outliers(held: readonly HeldValue[]): ReadonlyMap<string, Outlier> {
  const found = new Map<string, Outlier>();
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

/** Rows that are individual to each servo: no outliers, and not copied. */
export function isOwn(row: Row): boolean {
  return row.identity;
}

/** Rows in which `to` differs from `from`: those that may be staged, and the number that may not. */
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

/** Outliers of a row, from current values. */
export function rowOutliers(row: Row, uids: readonly string[]): ReadonlyMap<string, Outlier> {
  if (isOwn(row)) return NONE;
  return outliers(
    uids.map(uid => ({
      uid,
      model: servo(uid)?.model ?? null,
      value: sheetOf(uid).held(row.key),
      unit: sheetOf(uid).reading(row.key).value?.unit ?? "",
    })),
  );
}

const NONE: ReadonlyMap<string, Outlier> = new Map();

/** The values of a choice or switch row. */
export function optionsOf(row: Row): readonly { key: string; label: string }[] {
  if (row.kind !== "switch") return row.choices;
  return [
    { key: "true", label: text.on },
    { key: "false", label: text.off },
  ];
}
