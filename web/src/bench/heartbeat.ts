/** The heart-beat of a lease: often enough for a page that is slow, and none from a page that hangs. */
import { live, onHeard } from "./link";

/**
 * A sixth of the lease. Where the picture is drawn in software, timers and messages of a page that does nothing wrong
 * were seen to come a second late; three such in a row would be needed to lose it.
 */
export const BEAT_MS = 500;

let kept: string | null = null;
let timer: ReturnType<typeof setInterval> | undefined;
let said = 0;

/** Keeps this lease from now on, and no other. */
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

// A timer waits behind whatever came before it: with a heap of messages to work off, each of them is an occasion. Both
// run where the page itself runs, and nowhere else (no worker): when it hangs, so does the beat, and torque goes off.
onHeard(() => {
  if (kept !== null && performance.now() - said >= BEAT_MS) say();
});
