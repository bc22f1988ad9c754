/** The groups of the list: servos by heading, and folded headings. */
import type { ConditionKind } from "../bench/condition";
import type { KnownServo } from "../bench/fleet";
import { wordInAddress } from "../bench/route";
import { type Grouping, placeIn } from "./grouping";
import { severity } from "./order";

const folded = wordInAddress("folded");

export interface RowGroup {
  /** What its servos have in common: part of a label, a model, a state; "" if nothing. */
  key: string;
  uids: readonly string[];
}

/** What decides the group of a servo. */
export function groupOf(one: KnownServo, kind: ConditionKind, by: Grouping): string {
  if (by === "place") return placeIn(one.label);
  if (by === "model") return one.model ?? "";
  return by === "state" ? kind : "";
}

/** Servos in groups, each in the given order: groups by name, states worst first, ungrouped servos last. */
export function inGroups(uids: readonly string[], by: Grouping, keyOf: (uid: string) => string): RowGroup[] {
  const found = new Map<string, string[]>();
  for (const uid of uids) {
    const key = keyOf(uid);
    found.set(key, [...(found.get(key) ?? []), uid]);
  }
  const place = (key: string) => (by === "state" ? severity(key as ConditionKind) : 0);
  return [...found]
    .map(([key, each]) => ({ key, uids: each }))
    .sort(
      (a, b) =>
        Number(a.key === "") - Number(b.key === "") ||
        place(a.key) - place(b.key) ||
        a.key.localeCompare(b.key, undefined, { numeric: true }),
    );
}

/** No key contains this: in a label it separates the place. */
const BETWEEN = "|";

export function isFolded(key: string): boolean {
  return folded.value !== "" && folded.value.split(BETWEEN).includes(key === "" ? "-" : key);
}

export function fold(key: string, on: boolean): void {
  const word = key === "" ? "-" : key;
  const others = folded.peek() === "" ? [] : folded.peek().split(BETWEEN);
  folded.value = [...others.filter(one => one !== word), ...(on ? [word] : [])].join(BETWEEN);
}
