/** Heartbeat of a lease: frequent enough for a slow page, and stopped when the page hangs. */
import { live, onAnyMessage } from "./link";

/**
 * A sixth of the lease. With software rendering, timers and messages of a healthy page were seen a second late; it
 * takes three in a row to lose the lease.
 */
export const BEAT_MS = 500;

let leaseId: string | null = null;
let timer: ReturnType<typeof setInterval> | undefined;
let sentAt = 0;

/** Renew this lease from now on, and no other. */
export function startBeat(lease: string): void {
  stopBeat();
  leaseId = lease;
  say();
  timer = setInterval(say, BEAT_MS);
}

export function stopBeat(): void {
  clearInterval(timer);
  timer = undefined;
  leaseId = null;
}

function say(): void {
  if (leaseId === null) return;
  sentAt = performance.now();
  live.send({ type: "heartbeat", lease: leaseId });
}

// Timers may be delayed by a backlog of messages, so each message is an occasion, too. Both
// run on the main thread, not in a worker: if the page hangs, the heartbeat stops, and torque turns off.
onAnyMessage(() => {
  if (leaseId !== null && performance.now() - sentAt >= BEAT_MS) say();
});
