/** By what the list is grouped, and what that does to the name of a servo. */
import { changeChoices, oneInAddress } from "../bench/route";

export const GROUPINGS = ["none", "place", "model", "state"] as const;
export type Grouping = (typeof GROUPINGS)[number];

export const grouping = oneInAddress("group", GROUPINGS);

/** Another grouping, whose headings all stand open. */
export function groupBy(next: string): void {
  changeChoices({ group: next === GROUPINGS[0] ? "" : next, folded: "" });
}

/** What separates the place of a servo from its name: "Left wing / Flap", "Rig 2: arm". */
const APART = /\s*[/|:]\s*|\s+[-–—]\s+/;

/** The first part of a label; "" of a label that has one part. */
export function placeIn(label: string): string {
  const at = APART.exec(label);
  return at ? label.slice(0, at.index).trim() : "";
}

/** What to call a servo below the heading of its place: without that. */
export function nameBelow(name: string): string {
  const at = grouping.value === "place" ? APART.exec(name) : null;
  return (at && name.slice(at.index + at[0].length).trim()) || name;
}
