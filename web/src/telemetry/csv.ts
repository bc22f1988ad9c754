/** Owns the export of recent samples as CSV: one row a sample time, one column a channel, gaps empty. */
import type { TelemetryStore } from "./store";

/** Times are seconds relative to the newest sample; a point is the decimal sign, as programs expect. */
export function toCsv(
  store: TelemetryStore,
  uid: string,
  channels: readonly string[],
  seconds: number,
): string {
  const newest = Math.max(
    ...channels.map(key => store.ring(uid, key).lastTime).filter(t => !Number.isNaN(t)),
  );
  const rows = new Map<number, (number | null)[]>();
  channels.forEach((key, column) => {
    const { t, v } = store.ring(uid, key).since(newest - seconds);
    for (let i = 0; i < t.length; i++) {
      const at = t[i] ?? 0;
      const row = rows.get(at) ?? new Array<number | null>(channels.length).fill(null);
      const value = v[i] ?? Number.NaN;
      row[column] = Number.isNaN(value) ? null : value;
      rows.set(at, row);
    }
  });
  const lines = [...rows.entries()]
    .sort(([a], [b]) => a - b)
    .map(([at, row]) =>
      [(at - newest).toFixed(4), ...row.map(value => (value === null ? "" : String(value)))].join(","),
    );
  return [["t_s", ...channels].join(","), ...lines, ""].join("\r\n");
}
