/** The monotonic clock of the page, updated often enough for ages. */
import { signal } from "@preact/signals";

/** Seconds, monotonic. */
export function monotonic(): number {
  return performance.now() / 1000;
}

/** Updated five times a second while the tab is visible. */
export const now = signal(monotonic());

const PERIOD_MS = 200;

export function startClock(): () => void {
  const timer = setInterval(() => {
    if (!document.hidden) now.value = monotonic();
  }, PERIOD_MS);
  const seen = () => {
    if (!document.hidden) now.value = monotonic();
  };
  document.addEventListener("visibilitychange", seen);
  return () => {
    clearInterval(timer);
    document.removeEventListener("visibilitychange", seen);
  };
}
