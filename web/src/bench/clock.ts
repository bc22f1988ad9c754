/** The page's idea of now: our monotonic clock, told often enough for ages to be true. */
import { signal } from "@preact/signals";

/** Seconds on our monotonic clock. */
export function monotonic(): number {
  return performance.now() / 1000;
}

/** Changes five times a second while the tab is looked at. */
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
