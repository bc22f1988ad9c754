/** Staging of values that are not typed into a row: conversion and validity. */
import type { Row } from "../api/types";
import type { Draft } from "../bench/draft";
import { decimalsOf, number } from "../bench/format";
import { check, checkValue } from "../bench/number";
import type { Sheet, WantedValue } from "../bench/parameters";
import { spanOf } from "../bench/row-state";

/** `value` on this servo: a draft, or the reason against it. */
export function draftFor(sheet: Sheet, row: Row, value: WantedValue): Draft | { why: string } {
  const has = sheet.keys.peek();
  if (has !== null && !has.includes(row.key)) return { why: "" };
  if (typeof value !== "number") return { text: String(value), verdict: { ok: true, value } };
  const span = spanOf(row, sheet.reading(row.key).peek());
  const verdict = checkValue(value, span);
  return verdict.ok ? { text: number(value, decimalsOf(span.perUnit)), verdict } : { why: verdict.what };
}

/** Parse typed text with the unit of this servo's row; null if invalid. */
export function numberFor(sheet: Sheet, row: Row, typed: string): number | null {
  const { unit, perUnit } = spanOf(row, sheet.reading(row.key).peek());
  const verdict = check(typed, { unit, perUnit, minimum: null, maximum: null });
  return verdict.ok ? verdict.value : null;
}

/** Stage a value. A value equal to RAM removes the draft. */
export function stageValue(sheet: Sheet, key: string, draft: Draft): void {
  sheet.setOutcomes([[key, null]]);
  sheet.drafts.put(key, draft);
  sheet.drafts.commit(key, sheet.held(key));
}
