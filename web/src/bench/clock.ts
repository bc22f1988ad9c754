/** The monotonic clock of the page, updated often enough for ages. */
import { signal } from "@preact/signals";

/** Seconds, monotonic. */
export function monotonic(): number {
  return performance.now() / 1000;
}

/** Updated five times a second while the tab is visible. */
export const now = signal(monotonic());

const PERIOD_MS = 200;

let refreshes = 0;

/** Count a change of values all over the page. */
export function refreshed(): void {
  refreshes++;
}

/** Number of changes of values all over the page, by the clock and by reports of servos. */
export function refreshCount(): number {
  return refreshes;
}

function tick(): void {
  now.value = monotonic();
  refreshed();
}

export function startClock(): () => void {
  const timer = setInterval(() => {
    if (!document.hidden) tick();
  }, PERIOD_MS);
  const seen = () => {
    if (!document.hidden) tick();
  };
  document.addEventListener("visibilitychange", seen);
  return () => {
    clearInterval(timer);
    document.removeEventListener("visibilitychange", seen);
  };
}
