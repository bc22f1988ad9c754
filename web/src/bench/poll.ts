/** Ask again and again: only while the tab is seen and the link is up, and never twice at once. */
import { monotonic } from "./clock";
import { up } from "./link";

export interface Poll {
  /** Asks at once, and then in the old rhythm. */
  now: () => void;
  end: () => void;
}

/** Calls `look` at once and then `period_ms` after each answer. What `look` cannot do it must say by itself. */
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
  // Back in sight, or linked again: what is shown may be old by now.
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
