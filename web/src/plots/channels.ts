/** Which channels of a servo a plot can show, and how each is drawn. */
import type { Row } from "../api/types";
import { decimalsOf } from "../bench/format";
import type { LaneCurve } from "./lane";

/** Groups of rows that tell what a servo does; the others are settings, whose curves would be level lines. */
const GROUPS = new Set(["status", "command"]);

export interface Channel {
  key: string;
  label: string;
  unit: string;
  decimals: number;
}

/** Numbers the servo tells: what is measured first, then what is commanded. `has`: rows this servo has, if known. */
export function channelsOf(rows: Iterable<Row>, has: readonly string[] | null): Channel[] {
  return [...rows]
    .filter(row => row.kind === "number" && GROUPS.has(row.group) && (has === null || has.includes(row.key)))
    .sort((a, b) => Number(a.group === "command") - Number(b.group === "command"))
    .map(row => ({
      key: row.key,
      label: row.label,
      unit: row.unit ?? "",
      decimals: decimalsOf(row.per_unit),
    }));
}

export type Drawn = LaneCurve & { unit: string; decimals: number };

/** Curves of one servo: what is measured in ink, what is commanded in blue dashes; more than one of a unit in series. */
export function curvesOf(uid: string, chosen: readonly Channel[]): Drawn[] {
  const inked = new Set<string>();
  let series = 0;
  return chosen.map(one => {
    const dashed = one.key.startsWith("command_");
    const second = inked.has(one.unit);
    if (!dashed) inked.add(one.unit);
    return {
      uid,
      channel: one.key,
      name: one.label,
      unit: one.unit,
      decimals: one.decimals,
      dashed,
      colour: dashed ? "intent" : second ? series++ : "ink",
    };
  });
}
