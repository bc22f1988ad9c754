/** Values of rows as text without a live servo: snapshots, profiles, comparisons, the audit. */
import type { Value } from "../api/types";
import { text } from "../text";
import { catalog } from "./catalog";
import { full, NONE, withUnit } from "./format";

/** Label of a row; its key if unknown to the catalogue. */
export function rowLabelOf(key: string): string {
  const { rows, faults } = catalog.value ?? {};
  return rows?.get(key)?.label ?? faults?.find(one => one.key === key)?.label ?? key;
}

/** "0x38", or "". */
export function addressOf(key: string): string {
  return catalog.value?.rows.get(key)?.name ?? "";
}

/** A value with the unit it was recorded with, if any. */
export function valueText(key: string, value: unknown, unit?: string): string {
  if (value === null || value === undefined) return NONE;
  if (typeof value === "object") return several(value);
  const row = catalog.value?.rows.get(key);
  if (!row) return withUnit(String(value), unit ?? "");
  const other = unit !== undefined && row.unit_when && row.unit_when.unit === unit && unit !== row.unit;
  const shape = {
    unit: unit ?? row.unit,
    perUnit: other && row.unit_when ? row.unit_when.per_unit : row.per_unit,
    kind: row.kind,
    choices: row.choices,
    sided: row.sided ?? false,
  };
  return full(value as Value, shape);
}

/** More values than this are counted instead of listed. */
const SAID = 4;

/** Several named values in one line; missing ones are omitted. */
function several(value: object): string {
  const entries = Object.entries(value).filter(([, one]) => one !== null && one !== "");
  if (entries.length > SAID) return text.values(entries.length);
  if (Array.isArray(value)) return entries.map(([, one]) => valueText("", one)).join(", ");
  return entries.map(([key, one]) => `${rowLabelOf(key)} ${valueText(key, one)}`).join(", ") || NONE;
}
