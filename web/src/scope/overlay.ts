/** A recording laid over the scope: its first sample at the start of the window. */

import type { Drawn } from "../plots/channels";
import type { TimeSpan } from "../plots/span";
import type { Samples } from "../plots/trace";
import type { Recorded } from "../telemetry/csv";
import { idOf } from "./layout";

export interface LaidOver {
  name: string;
  content: Recorded;
}

/** The column of a file that is a curve's channel, drawn faintly in its colour; null without one. */
export function overlayCurve(one: LaidOver, curve: Drawn, span: TimeSpan): Drawn | null {
  const { name, channel } = curve;
  const { columns } = one.content;
  const column =
    columns.find(each => each.head === `${name}/${channel}`) ?? columns.find(each => each.head === channel);
  if (!column) return null;
  const start = Math.min(...columns.map(each => each.t[0] ?? Number.POSITIVE_INFINITY));
  let shift = Number.NaN;
  let laid: Samples = { t: column.t, v: column.v };
  const samples = () => {
    const next = (span.shown()?.from ?? start) - start;
    if (next !== shift) laid = { t: column.t.map(t => t + next), v: column.v };
    shift = next;
    return laid;
  };
  return { ...curve, uid: `${one.name}/${idOf(curve)}`, name: one.name, faint: true, samples };
}
