/** The parameter catalogue: rows, groups as tabs, fault bits. Loaded once per schema revision. */
import { signal } from "@preact/signals";
import { callApi } from "../api/client";
import type { FaultRow, Row, Schema } from "../api/types";
import { text } from "../text";

export interface Tab {
  key: string;
  label: string;
  description: string;
  rows: readonly Row[];
}

export interface Catalog {
  revision: string;
  tabs: readonly Tab[];
  rows: ReadonlyMap<string, Row>;
  faults: readonly FaultRow[];
}

export const catalog = signal<Catalog | null>(null);

/** Groups of commands, readings and operations: they have no tab. */
const ELSEWHERE = new Set(["command", "status", "operation", "faults"]);
/** The production date is shown with the product data. */
const MERGED: Readonly<Record<string, string>> = { production: "product" };

/** A row with names in the page's language, or the server's. */
function named(row: Row): Row {
  const choices = row.choices.map(one => ({ ...one, label: text.table.choices[one.key] ?? one.label }));
  return { ...row, label: text.table.rows[row.key] ?? row.label, choices };
}

/** A fault with name and advice in the page's language, or the server's. */
export function namedFault<T extends Pick<FaultRow, "key" | "label" | "advice">>(fault: T): T {
  const { faults, advice } = text.table;
  return { ...fault, label: faults[fault.key] ?? fault.label, advice: advice[fault.key] ?? fault.advice };
}

export function build(schema: Schema): Catalog {
  const readable = schema.parameters.filter(row => row.access !== "w");
  const rows = new Map(readable.map(row => [row.key, named(row)]));
  const tabs = schema.groups
    .filter(group => !ELSEWHERE.has(group.key) && !(group.key in MERGED))
    .map(group => ({
      key: group.key,
      label: text.table.groups[group.key] ?? group.label,
      description: group.description,
      rows: [...rows.values()].filter(row => (MERGED[row.group] ?? row.group) === group.key),
    }))
    .filter(tab => tab.rows.length > 0);
  return { revision: schema.revision, tabs, rows, faults: schema.faults.map(namedFault) };
}

let coming: Promise<void> | null = null;

/** Requested once by those who want it at the same time. */
export async function loadCatalog(revision?: string): Promise<void> {
  if (revision !== undefined && catalog.peek()?.revision === revision) return;
  coming ??= callApi("GET", "/schema")
    .then(schema => {
      catalog.value = build(schema);
    })
    .finally(() => {
      coming = null;
    });
  await coming;
}
