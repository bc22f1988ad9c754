/** The order of the servos in the list: by a column, up or down, with what is not known at the end. */
import type { ConditionKind } from "../bench/condition";

export const COLUMNS = ["angle", "name", "ids", "health", "supply", "age", "rom"] as const;
export type SortColumn = (typeof COLUMNS)[number];
export type Way = "ascending" | "descending";

export interface Sorting {
  column: SortColumn;
  way: Way;
}

/** Figures that change by themselves: rows are put in order when it is asked for, and then stay where they are. */
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

/** How a sorting is written in an address: "name", or "-name" for descending. */
export function sortingIn(text: string): Sorting | null {
  const column = COLUMNS.find(one => one === text.replace(/^-/, ""));
  return column ? { column, way: text.startsWith("-") ? "descending" : "ascending" } : null;
}

export function sortingText(sorting: Sorting | null): string {
  return sorting === null ? "" : `${sorting.way === "descending" ? "-" : ""}${sorting.column}`;
}

/** Pressing a column's head: another column begins ascending, the same one turns round, a third press ends it. */
export function pressed(sorting: Sorting | null, column: SortColumn): Sorting | null {
  if (sorting?.column !== column) return { column, way: "ascending" };
  return sorting.way === "ascending" ? { column, way: "descending" } : null;
}

/** `uids` by what `fact` says of each; equal ones keep their order, those without a fact come last either way. */
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
