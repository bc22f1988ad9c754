/** Owns the step from rings to the columns a plot draws: two curves on one time axis, gaps kept as gaps. */
import type { Window } from "../telemetry/ring";

/** undefined: no sample of this curve at this time; null: a gap, the curve breaks. */
export type Cell = number | null | undefined;

export interface Columns {
  x: number[];
  angle: Cell[];
  command: Cell[];
}

/**
 * Merges two windows into columns; x in seconds before `now` (negative). Samples further apart than `gap` seconds,
 * and samples that are gaps themselves, break the curve.
 */
export function merge(angle: Window, command: Window, now: number, gap: number): Columns {
  const out: Columns = { x: [], angle: [], command: [] };
  let i = 0;
  let j = 0;
  let lastAngle = Number.NaN;
  let lastCommand = Number.NaN;
  while (i < angle.t.length || j < command.t.length) {
    const ta = i < angle.t.length ? (angle.t[i] ?? 0) : Number.POSITIVE_INFINITY;
    const tc = j < command.t.length ? (command.t[j] ?? 0) : Number.POSITIVE_INFINITY;
    const t = Math.min(ta, tc);
    const hasAngle = ta === t;
    const hasCommand = tc === t;
    const breakAngle = hasAngle && t - lastAngle > gap;
    const breakCommand = hasCommand && t - lastCommand > gap;
    if (breakAngle || breakCommand) {
      out.x.push(t - now - 1e-6);
      out.angle.push(breakAngle ? null : undefined);
      out.command.push(breakCommand ? null : undefined);
    }
    out.x.push(t - now);
    out.angle.push(hasAngle ? cell(angle.v[i]) : undefined);
    out.command.push(hasCommand ? cell(command.v[j]) : undefined);
    if (hasAngle) {
      lastAngle = t;
      i++;
    }
    if (hasCommand) {
      lastCommand = t;
      j++;
    }
  }
  spread(out.angle);
  spread(out.command);
  return out;
}

/** The plot ends a gap at the next column: so a gap has to fill every column between two samples of its curve. */
function spread(column: Cell[]): void {
  for (let i = 1; i < column.length; i++)
    if (column[i] === undefined && column[i - 1] === null) column[i] = null;
  for (let i = column.length - 2; i >= 0; i--)
    if (column[i] === undefined && column[i + 1] === null) column[i] = null;
}

function cell(value: number | undefined): Cell {
  return value === undefined || Number.isNaN(value) ? null : value;
}

/** A calm range round what is drawn: whole tens, at least 20° high, and steady while the curve stays inside. */
export function calmRange(columns: Columns, before: [number, number] | null): [number, number] {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const column of [columns.angle, columns.command]) {
    for (const value of column) {
      if (value === null || value === undefined) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (low > high) return before ?? [-10, 10];
  const step = high - low > 200 ? 50 : 10;
  let from = Math.floor((low - 2) / step) * step;
  let to = Math.ceil((high + 2) / step) * step;
  if (to - from < 20) {
    from -= 10;
    to += 10;
  }
  const margin = before ? 0.04 * (before[1] - before[0]) : 0;
  const inside = before !== null && low >= before[0] + margin && high <= before[1] - margin;
  if (inside && before[1] - before[0] <= 2 * (to - from)) return before;
  return [from, to];
}
