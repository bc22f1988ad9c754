/** The past of a plot: samples the server kept from before this page heard any, put before those it has. */
import { API } from "../api/client";
import { fromCsv } from "../telemetry/csv";
import { telemetry } from "../telemetry/store";

/** How far back each channel was asked for already, as a time of the server, whose clock begins anew with it. */
const asked = new Map<string, number>();
const place = (uid: string, key: string) => `${telemetry.utcOffset.toFixed(0)}/${uid}/${key}`;
/** A second more or less is not worth asking for. */
const SLACK_S = 2;

/** Asks for the last seconds of channels, once for each part of time. What does not come is not drawn. */
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
    const oldest = Math.min(Number.isNaN(known) ? now : known, asked.get(place(uid, key)) ?? now);
    return oldest > from + SLACK_S;
  });
  if (wanted.length === 0) return;
  for (const key of wanted) asked.set(place(uid, key), from);
  try {
    const query = `seconds=${seconds}&channels=${wanted.join(",")}`;
    const answer = await fetch(`${API}/servos/${uid}/telemetry.csv?${query}`);
    const found = answer.ok ? fromCsv(await answer.text()) : null;
    for (const one of found?.columns ?? []) telemetry.pushPast(uid, one.head, one.t, one.v);
  } catch {
    for (const key of wanted) asked.delete(place(uid, key));
  }
}
