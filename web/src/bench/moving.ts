/** True if any horn moves or is commanded, as far as known; unknown counts as moving. */
import { computed } from "@preact/signals";
import { telemetry } from "../telemetry/store";
import { leases, stop } from "./bench";
import { monotonic, now } from "./clock";
import { all, type KnownServo } from "./fleet";
import { ended, jobs } from "./jobs";
import { up } from "./link";
import { motion } from "./motion";
import { released } from "./release";

/** A horn moves if it turned more than this within the window; less is noise or hunting. */
const MOVED_DEG = 3;
const WINDOW_S = 0.5;

/** States in which a servo moves its horn without a command, or may. */
const RESTARTS: ReadonlySet<KnownServo["state"]> = new Set(["saving", "restarting", "soft_start"]);

/** Motion of this page is on, or turning on. */
export function motionOn(): boolean {
  const { phase } = motion.value;
  return phase === "on" || phase === "requesting";
}

/** Esc must stop at the first press. Any client's lease counts: it may move servos at any time. */
export function moving(at: number = monotonic()): boolean {
  return (
    motionOn() ||
    !up.value ||
    leases.value.some(one => one.endsAt > at) ||
    [...released.value.values()].some(state => state !== "off") ||
    (stop.value?.latched === true && stop.value.servos.some(one => !one.confirmed)) ||
    [...jobs.value.values()].some(job => !ended(job)) ||
    all.value.some(one => RESTARTS.has(one.state) || turns(one.uid, at))
  );
}

/** The same as a signal. */
export const movingNow = computed(() => moving(now.value));

function turns(uid: string, at: number): boolean {
  if (telemetry.latest(uid, "current_angle", at) === null) return false;
  const from = telemetry.serverTime(at) - WINDOW_S;
  const { t, v } = telemetry.ring(uid, "current_angle").since(from);
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (let i = 0; i < t.length; i++) {
    const angle = v[i] ?? Number.NaN;
    if ((t[i] ?? 0) < from || Number.isNaN(angle)) continue;
    low = Math.min(low, angle);
    high = Math.max(high, angle);
  }
  return high - low > MOVED_DEG;
}
