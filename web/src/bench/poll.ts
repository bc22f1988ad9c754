/** Polling: only while the tab is visible and the link is up, one request at a time. */
import { monotonic } from "./clock";
import { up } from "./link";

export interface Poll {
  /** Request now, then continue the schedule. */
  now: () => void;
  end: () => void;
}

/** Call `look` now, then `period_ms` after each response. `look` handles its own errors. */
export function poll(period_ms: number, look: () => Promise<void>): Poll {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let busy = false;
  let again = false;
  let over = false;
  let lookedAt = Number.NEGATIVE_INFINITY;

  const turn = async () => {
    clearTimeout(timer);
    if (busy) again = true;
    if (busy || over) return;
    if (!document.hidden && up.peek()) {
      busy = true;
      lookedAt = monotonic();
      try {
        await look();
      } finally {
        busy = false;
      }
    }
    if (over) return;
    timer = setTimeout(() => void turn(), again ? 0 : period_ms);
    again = false;
  };
  // Visible or connected again: the values may be old.
  const late = () => {
    if ((monotonic() - lookedAt) * 1000 >= period_ms) void turn();
  };
  const forget = up.subscribe(isUp => {
    if (isUp) void turn();
  });
  document.addEventListener("visibilitychange", late);
  return {
    now: () => void turn(),
    end: () => {
      over = true;
      clearTimeout(timer);
      forget();
      document.removeEventListener("visibilitychange", late);
    },
  };
}
