/** Samples as CSV, written and read: one row per sample time, one column per channel, an empty cell for a gap. */
import type { TelemetryStore } from "./store";

export interface CsvColumn {
  uid: string;
  channel: string;
  /** Column heading; it ends with the channel. */
  head: string;
}

/**
 * Samples of a time span (server clock, inclusive) in the format of the server's `telemetry.csv`:
 * `t_utc`, `t_s`, then one cell per channel, with a decimal point.
 */
export function toCsv(
  store: TelemetryStore,
  columns: readonly CsvColumn[],
  from: number,
  to: number,
): string {
  const rows = new Map<number, (number | null)[]>();
  columns.forEach((one, place) => {
    const { t, v } = store.ring(one.uid, one.channel).since(from);
    for (let i = 0; i < t.length; i++) {
      const at = t[i] ?? 0;
      if (at < from || at > to) continue;
      const row = rows.get(at) ?? new Array<number | null>(columns.length).fill(null);
      const value = v[i] ?? Number.NaN;
      row[place] = Number.isNaN(value) ? null : value;
      rows.set(at, row);
    }
  });
  const lines = [...rows.entries()]
    .sort(([a], [b]) => a - b)
    .map(([at, row]) =>
      [utc(store, at), at.toFixed(6), ...row.map(value => (value === null ? "" : String(value)))].join(","),
    );
  return [["t_utc", "t_s", ...columns.map(one => quoted(one.head))].join(","), ...lines, ""].join("\r\n");
}

function utc(store: TelemetryStore, at: number): string {
  const ms = (at + store.utcOffset) * 1000;
  return Number.isFinite(ms) ? new Date(ms).toISOString() : "";
}

// Names are user input: a spreadsheet must not interpret them as a formula.
function quoted(head: string): string {
  const plain = /^[=+\-@\t\r]/.test(head) ? `'${head}` : head;
  return /[",\r\n]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

export interface Recorded {
  /** Heading, times and values of each column; NaN is a gap. */
  columns: { head: string; t: Float64Array; v: Float64Array }[];
  /** Offset of the times to UTC; NaN if the file has none. */
  utcOffset: number;
}

/** Parse such a file; null for any other file. Lines without samples are left out. */
export function fromCsv(text: string): Recorded | null {
  const lines = text.split(/\r?\n/);
  const heads = cells((lines[0] ?? "").replace(/^\uFEFF/, ""));
  const time = heads.indexOf("t_s");
  const utcAt = heads.indexOf("t_utc");
  if (time < 0) return null;
  const found = heads.map(head => ({ head, t: [] as number[], v: [] as number[] }));
  let utcOffset = Number.NaN;
  let before = Number.NEGATIVE_INFINITY;
  for (const line of lines.slice(1)) {
    const row = cells(line);
    const at = Number(row[time] || Number.NaN);
    if (!Number.isFinite(at) || at <= before) continue;
    before = at;
    if (Number.isNaN(utcOffset) && utcAt >= 0) utcOffset = Date.parse(row[utcAt] ?? "") / 1000 - at;
    row.forEach((cell, place) => {
      const value = Number(cell);
      if (cell === "" || place === time || place === utcAt || !Number.isFinite(value)) return;
      found[place]?.t.push(at);
      found[place]?.v.push(value);
    });
  }
  const columns = found
    .filter(one => one.t.length > 0)
    .map(one => ({ head: one.head, t: Float64Array.from(one.t), v: Float64Array.from(one.v) }));
  return columns.length === 0 ? null : { columns, utcOffset };
}

function cells(line: string): string[] {
  if (!line.includes('"')) return line.split(",");
  const out: string[] = [];
  for (const found of line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g)) {
    out.push(found[1] === undefined ? (found[2] ?? "") : found[1].replaceAll('""', '"'));
  }
  return out;
}
