/** Heartbeat of a lease: frequent enough for a slow page, and stopped when the page hangs. */
import { live, onHeard } from "./link";

/**
 * A sixth of the lease. With software rendering, timers and messages of a healthy page were seen a second late; it
 * takes three in a row to lose the lease.
 */
export const BEAT_MS = 500;

let kept: string | null = null;
let timer: ReturnType<typeof setInterval> | undefined;
let said = 0;

/** Renew this lease from now on, and no other. */
export function startBeat(lease: string): void {
  stopBeat();
  kept = lease;
  say();
  timer = setInterval(say, BEAT_MS);
}

export function stopBeat(): void {
  clearInterval(timer);
  timer = undefined;
  kept = null;
}

function say(): void {
  if (kept === null) return;
  said = performance.now();
  live.send({ type: "heartbeat", lease: kept });
}

// Timers may be delayed by a backlog of messages, so each message is an occasion, too. Both
// run on the main thread, not in a worker: if the page hangs, the heartbeat stops, and torque turns off.
onHeard(() => {
  if (kept !== null && performance.now() - said >= BEAT_MS) say();
});
