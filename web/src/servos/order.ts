/** The order of the servos in the list: by a column, ascending or descending, unknown values last. */
import type { ConditionKind } from "../bench/condition";

export const COLUMNS = ["angle", "name", "ids", "health", "supply", "age", "rom"] as const;
export type SortColumn = (typeof COLUMNS)[number];
export type Way = "ascending" | "descending";

export interface Sorting {
  column: SortColumn;
  way: Way;
}

/** Figures that change continuously: the list is sorted once, on request, so that rows stay in place. */
const LIVE: ReadonlySet<SortColumn> = new Set(["angle", "supply", "age"]);

export function standsStill(column: SortColumn): boolean {
  return LIVE.has(column);
}

/** Worst first. */
const SEVERITY: readonly ConditionKind[] = [
  "failure",
  "protected",
  "warning",
  "offline",
  "notice",
  "busy",
  "identifying",
  "ok",
];

export function severity(kind: ConditionKind): number {
  return SEVERITY.indexOf(kind);
}

/** A sorting as written in an address: "name", or "-name" for descending. */
export function sortingIn(text: string): Sorting | null {
  const column = COLUMNS.find(one => one === text.replace(/^-/, ""));
  return column ? { column, way: text.startsWith("-") ? "descending" : "ascending" } : null;
}

export function sortingText(sorting: Sorting | null): string {
  return sorting === null ? "" : `${sorting.way === "descending" ? "-" : ""}${sorting.column}`;
}

/**
 * A press on a column head: a new column starts ascending, the same column turns descending, a third press clears it.
 */
export function pressed(sorting: Sorting | null, column: SortColumn): Sorting | null {
  if (sorting?.column !== column) return { column, way: "ascending" };
  return sorting.way === "ascending" ? { column, way: "descending" } : null;
}

/** `uids` sorted by `fact`. Stable; servos without a value come last in both directions. */
export function ordered(
  uids: readonly string[],
  way: Way,
  fact: (uid: string) => number | string | null,
): string[] {
  const turn = way === "ascending" ? 1 : -1;
  const facts = uids.map(uid => ({ uid, fact: fact(uid) }));
  const known = facts.filter(one => one.fact !== null);
  known.sort((a, b) => turn * compare(a.fact ?? 0, b.fact ?? 0));
  return [...known, ...facts.filter(one => one.fact === null)].map(one => one.uid);
}

function compare(a: number | string, b: number | string): number {
  if (typeof a === "number" && typeof b === "number") return a - b;
  return String(a).localeCompare(String(b), undefined, { numeric: true });
}
