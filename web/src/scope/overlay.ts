/** Scope overlays: a recording from its first sample, or the step of a run, aligned with the trigger if one fired. */

import type { StepRun } from "../api/lab-types";
import type { Drawn } from "../plots/channels";
import type { TimeSpan } from "../plots/span";
import type { Samples } from "../plots/trace";
import type { Recorded } from "../telemetry/csv";
import { idOf } from "./layout";

export interface ScopeOverlay {
  name: string;
  content: Pick<Recorded, "columns">;
  /** Its time 0 is aligned with the trigger. */
  atTrigger?: boolean;
}

/** The first step of a run with its command, by servo name; time 0 is the command. */
export function overlayOfRun(run: StepRun, name: string, servo: string): ScopeOverlay | null {
  const [step] = run.steps;
  const last = step?.t.at(-1);
  if (!step || last === undefined) return null;
  const before = Math.min(0, step.t[0] ?? 0);
  return {
    name,
    atTrigger: true,
    content: {
      columns: [
        {
          head: `${servo}/current_angle`,
          t: Float64Array.from(step.t),
          v: Float64Array.from(step.angle_deg),
        },
        {
          head: `${servo}/command_angle`,
          t: Float64Array.of(before, 0, 0, last),
          v: Float64Array.of(step.from_deg, step.from_deg, step.to_deg, step.to_deg),
        },
      ],
    },
  };
}

/** The column of a file for a curve's channel, drawn faintly in its colour; null without one. */
export function overlayCurve(one: ScopeOverlay, curve: Drawn, span: TimeSpan): Drawn | null {
  const { name, channel } = curve;
  const { columns } = one.content;
  const column =
    columns.find(each => each.head === `${name}/${channel}`) ?? columns.find(each => each.head === channel);
  if (!column) return null;
  const start = Math.min(...columns.map(each => each.t[0] ?? Number.POSITIVE_INFINITY));
  let shift = Number.NaN;
  let laid: Samples = { t: column.t, v: column.v };
  const samples = () => {
    const shown = span.shown();
    const next = one.atTrigger && span.still.value ? span.still.value.zero : (shown?.from ?? start) - start;
    if (next !== shift) laid = { t: column.t.map(t => t + next), v: column.v };
    shift = next;
    return laid;
  };
  return { ...curve, uid: `${one.name}/${idOf(curve)}`, name: one.name, faint: true, samples };
}
