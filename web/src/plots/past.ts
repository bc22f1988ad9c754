/** History of a plot: samples stored by the server before this page subscribed, inserted before the live ones. */
import { API } from "../api/client";
import { fromCsv } from "../telemetry/csv";
import { telemetry } from "../telemetry/store";

/** Earliest server time already requested, by channel; the server's clock restarts with the server. */
const requested = new Map<string, number>();
const place = (uid: string, key: string) => `${telemetry.utcOffset.toFixed(0)}/${uid}/${key}`;
/** Differences below a second are not worth a request. */
const SLACK_S = 2;

/** Request the last seconds of channels, each time span once. Missing samples are not drawn. */
export async function recallSamples(
  uid: string,
  channels: readonly string[],
  seconds: number,
): Promise<void> {
  const now = telemetry.serverTime(performance.now() / 1000);
  if (Number.isNaN(now)) return;
  const from = now - seconds;
  const wanted = channels.filter(key => {
    const known = telemetry.ring(uid, key).firstTime;
    const oldest = Math.min(Number.isNaN(known) ? now : known, requested.get(place(uid, key)) ?? now);
    return oldest > from + SLACK_S;
  });
  if (wanted.length === 0) return;
  for (const key of wanted) requested.set(place(uid, key), from);
  try {
    const query = `seconds=${seconds}&channels=${wanted.join(",")}`;
    const response = await fetch(`${API}/servos/${uid}/telemetry.csv?${query}`);
    const found = response.ok ? fromCsv(await response.text()) : null;
    for (const one of found?.columns ?? []) telemetry.pushPast(uid, one.head, one.t, one.v);
  } catch {
    for (const key of wanted) requested.delete(place(uid, key));
  }
}
