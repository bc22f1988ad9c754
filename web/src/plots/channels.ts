/** Channels of a servo that a plot can show, and their styles. */
import type { Row } from "../api/types";
import { decimalsOf } from "../bench/format";
import type { LaneCurve } from "./lane";

/** Groups of rows with changing values; the others are settings, whose curves would be flat. */
const GROUPS = new Set(["status", "command"]);

export interface Channel {
  key: string;
  label: string;
  unit: string;
  decimals: number;
}

/** Numeric rows of a servo: measured ones first, then commands. `has`: rows of this servo, if known. */
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

/** Curves of one servo: measured in ink, commands in blue dashes; several of one unit in series colours. */
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
