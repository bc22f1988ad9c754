/** Grouping of the list, and its effect on the displayed name. */
import { changeChoices, oneInAddress } from "../bench/route";

export const GROUPINGS = ["none", "place", "model", "state"] as const;
export type Grouping = (typeof GROUPINGS)[number];

export const grouping = oneInAddress("group", GROUPINGS);

/** Change the grouping and unfold all headings. */
export function groupBy(next: string): void {
  changeChoices({ group: next === GROUPINGS[0] ? "" : next, folded: "" });
}

/** Separates the place of a servo from its name: "Left wing / Flap", "Rig 2: arm". */
const APART = /\s*[/|:]\s*|\s+[-–—]\s+/;

/** The first part of a label; "" if the label has one part. */
export function placeIn(label: string): string {
  const at = APART.exec(label);
  return at ? label.slice(0, at.index).trim() : "";
}

/** The name of a servo below the heading of its place: without the place. */
export function nameBelow(name: string): string {
  const at = grouping.value === "place" ? APART.exec(name) : null;
  return (at && name.slice(at.index + at[0].length).trim()) || name;
}
