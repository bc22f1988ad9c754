/** Get motion control from another holder: by request, with a countdown, or by force, with a reason. */

import { callApi, problemOf } from "../api/client";
import type { TakeOverState } from "../api/types";
import { monotonic } from "../bench/clock";
import { problemText } from "../bench/facts";
import { holder, who } from "../bench/holder";
import { hold, leaseOfOther, motion, motionRefusal, TTL_S, withdraw } from "../bench/motion";
import { takeOver as words } from "./words";

/** Time for the holder to refuse, s. */
export const REFUSAL_TIME_S = 10;
/** A request whose client is not seen for five seconds is withdrawn. */
const LOOK_MS = 1000;

/**
 * Request motion control. It is granted when the holder releases it or does not refuse; torque then stays off until
 * turned on.
 */
export async function requestControl(uid: string, reason: string): Promise<void> {
  if (motion.peek().phase !== "off") return;
  motion.value = { phase: "requesting", uid };
  motionRefusal.value = null;
  try {
    const body = {
      holder: holder(),
      uids: [uid],
      ttl_s: TTL_S,
      reason: reason.trim(),
      timeout_s: REFUSAL_TIME_S,
    };
    const reported = await callApi("POST", "/leases/requests", { body });
    if (motion.peek().phase === "requesting") follow(uid, reported);
    else await withdraw(reported.id);
  } catch (error) {
    fail(error);
  }
}

/** Take motion control by force: torque turns off on the servos of the holder. `reason` is stored in the audit. */
export async function forceControl(uid: string, reason: string): Promise<void> {
  const phase = motion.peek().phase;
  if (phase !== "off" && phase !== "waiting") return;
  motion.value = { phase: "requesting", uid };
  motionRefusal.value = null;
  try {
    const body = { holder: holder(), uids: [uid], ttl_s: TTL_S, force: true, reason: reason.trim() };
    const lease = await callApi("POST", "/leases", { body });
    if (motion.peek().phase === "requesting") hold(uid, lease.id);
    else
      await callApi("DELETE", "/leases/{lease_id}", { path: { lease_id: lease.id }, keepalive: true }).catch(
        () => undefined,
      );
  } catch (error) {
    fail(error);
  }
}

function follow(uid: string, reported: TakeOverState): void {
  const before = motion.peek();
  const from = reported.holder?.holder ?? (before.phase === "waiting" ? before.from : "");
  if (reported.state === "granted" && reported.lease_id) hold(uid, reported.lease_id);
  else if (reported.state === "waiting") {
    const endsAt = monotonic() + reported.expires_in_s;
    motion.value = { phase: "waiting", uid, request: reported.id, from, endsAt };
    setTimeout(() => void look(reported.id), Math.min(LOOK_MS, 1000 * reported.expires_in_s + 50));
  } else {
    const keeps = leaseOfOther(uid)?.holder ?? from;
    motion.value = {
      phase: "off",
      why: reported.state === "refused" ? words.refused(who(keeps)) : words.over,
    };
  }
}

async function look(request: string): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "waiting" || present.request !== request) return;
  try {
    const reported = await callApi("GET", "/leases/requests/{request_id}", { path: { request_id: request } });
    const now = motion.peek();
    if (now.phase === "waiting" && now.request === request) follow(present.uid, reported);
    else if (reported.lease_id) await withdraw(request);
  } catch (error) {
    const now = motion.peek();
    if (now.phase !== "waiting" || now.request !== request) return;
    // A lost link ends the request; a single lost response does not.
    if (problemOf(error).code === "no_link") setTimeout(() => void look(request), LOOK_MS);
    else motion.value = { phase: "off", why: problemText(problemOf(error)) };
  }
}

function fail(error: unknown): void {
  motionRefusal.value = problemText(problemOf(error));
  if (motion.peek().phase === "requesting") motion.value = { phase: "off", why: null };
}
