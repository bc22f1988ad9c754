/** Motion from this page: one lease, heartbeat, torque, commands, and every end of it. */

import { effect, signal } from "@preact/signals";
import { callApi, Problem, problemOf } from "../api/client";
import type { Caution, Commanded, LeaseView, Reading, TorqueMode } from "../api/types";
import { telemetry } from "../telemetry/store";
import { text } from "../text";
import { covers, type HeldLease, leases, stopped } from "./bench";
import { cautionText } from "./caution-text";
import { monotonic } from "./clock";
import { failureText, problemText } from "./facts";
import { angleOf, peekServo } from "./fleet";
import { startBeat, stopBeat } from "./heartbeat";
import { haveLease, holder, isOurs, who } from "./holder";
import { live, onRefusal, up } from "./link";
import { followRelease, forget } from "./release";
import { onLeave } from "./route";
import { stopInSight, stopSeen } from "./stop-sight";
import { Newest } from "./throttle";

export type Motion =
  | { phase: "off"; why: string | null }
  | { phase: "requesting"; uid: string }
  /** Motion control was requested from another holder; it passes at `endsAt`, monotonic. */
  | { phase: "waiting"; uid: string; request: string; from: string; endsAt: number }
  /** This page has the lease with torque off: it arrived later, so nothing starts automatically. */
  | { phase: "held"; uid: string; lease: string }
  | { phase: "on"; uid: string; lease: string; torque: TorqueMode; others: readonly string[] };

export const motion = signal<Motion>({ phase: "off", why: null });

/** The last commanded angle, degrees; null before the first. */
export const setpoint = signal<number | null>(null);

/** Why the last command or request was refused, in words. */
export const motionRefusal = signal<string | null>(null);

/** Cautions in the response to the last command. */
export const warnings = signal<readonly string[]>([]);

export interface MotionQuestion {
  angle: number;
  /** Confirmation words for the request. */
  words: readonly string[];
  cautions: readonly string[];
}

/** A move that needs a confirmation. */
export const question = signal<MotionQuestion | null>(null);

/** The servo whose horn can be dragged, and its range: set by the dial of the jog pad only. */
export const dragSpan = signal<{ uid: string; limits: { ccw: number; cw: number } } | null>(null);

export interface MotionProfile {
  speed_deg_s: number;
  accel_deg_s2: number;
}

/** Servos commanded together with this one; the part of the page that started it decides how. */
export interface Together {
  /** Hold all of them in place under the lease, with torque on. */
  begin: (lease: string) => Promise<void>;
  move: (
    angle: number,
    lease: string,
    profile: MotionProfile | null,
    signal?: AbortSignal,
  ) => Promise<Commanded>;
  drag: (angle: number, lease: string, profile: MotionProfile | null) => void;
}

export const movingTogether = signal<Together | null>(null);

/** Speed of a jog, °/s, or null for the servo's maximum. */
export const pace = signal<number | null>(60);
/** A jog reaches its speed in a quarter of a second. */
const SPEED_UP_S = 0.25;

export const TTL_S = 3;
/** A passing lease has no holder for a quarter of a second, and the message may be later. */
const PASSING_MS = 3000;
/** How long Stop may be hidden while a window or keyboard is resized. */
const HIDDEN_MS = 300;
const DRAG_PERIOD_MS = 1000 / 30;

/** True if another client has this lease. A new lease is reported before its ID arrives. */
export function isOfOther(view: LeaseView): boolean {
  return motion.value.phase !== "requesting" && !isOurs(view);
}

/** Lease header of this page's requests; none while it has no motion. */
export function leaseHeader(): Record<string, string> {
  const held = motion.peek();
  return held.phase === "on" ? { Lease: held.lease } : {};
}

/** The lease of another client that covers this servo, or null. */
export function leaseOfOther(uid: string): HeldLease | null {
  return leases.value.find(one => covers(one, [uid]) && isOfOther(one)) ?? null;
}

/** Take the lease and turn torque on for the servo and `others`. Nothing moves: they hold their angles. */
export async function enableMotion(
  uid: string,
  others: readonly string[] = [],
  group: Together | null = null,
): Promise<void> {
  const members = [uid, ...others];
  try {
    if (!stopSeen()) throw new Problem("stop_hidden", 0, text.motion.stopHidden);
    await takeControl(members, members, group, async lease => {
      await energise(members, group, lease);
      return members;
    });
  } catch (error) {
    motionRefusal.value = problemText(problemOf(error));
  }
}

/** Our lease with torque on for this servo and others, taken first if motion is off. Throws the reason why not. */
export async function leaseFor(uid: string, others: readonly string[] = []): Promise<string> {
  const before = motion.peek();
  if (before.phase !== "on") await enableMotion(uid, others);
  else if (before.uid === uid) {
    const missing = others.filter(each => !before.others.includes(each));
    if (missing.length > 0) await addToLease(before.lease, missing);
    await energise(missing, null, before.lease);
    if (missing.length > 0 && motion.peek() === before)
      motion.value = { ...before, others: [...before.others, ...missing] };
  }
  const present = motion.peek();
  if (present.phase === "on" && present.uid === uid) return present.lease;
  throw new Problem("motion_off", 0, motionRefusal.peek() ?? text.motion.notEnabled);
}

/**
 * Take a lease of `members`, or continue ours. Servos whose output `switchOn` returns are under command from then on. If cancelled
 * meanwhile, or none is switched on, release the lease and write torque off to `off`; the server handles the others.
 * Throws on failure.
 */
export async function takeControl(
  members: readonly string[],
  off: readonly string[],
  group: Together | null,
  switchOn: (lease: string) => Promise<readonly string[]>,
): Promise<void> {
  const before = motion.peek();
  const uid = members[0];
  if (uid === undefined || (before.phase !== "off" && before.phase !== "held")) return;
  const requesting: Motion = { phase: "requesting", uid };
  // Cancelled, and perhaps requested again: not ours to continue.
  const still = () => motion.peek() === requesting;
  motion.value = requesting;
  motionRefusal.value = null;
  const end = () => {
    if (!still()) return;
    stopBeat();
    motion.value = { phase: "off", why: null };
  };
  try {
    const lease =
      before.phase === "held"
        ? before.lease
        : (await callApi("POST", "/leases", { body: { holder: holder(), uids: members, ttl_s: TTL_S } })).id;
    if (!still()) {
      await release(off, lease);
      return;
    }
    keep(lease);
    let on: readonly string[];
    try {
      if (before.phase === "held" && members.some(each => each !== before.uid))
        await addToLease(lease, members);
      on = await switchOn(lease);
    } catch (error) {
      if (still()) stopBeat();
      await release(off, lease);
      throw error;
    }
    const [first, ...others] = on;
    if (!still() || first === undefined) {
      if (still()) stopBeat();
      await release(off, lease);
      end();
      return;
    }
    setpoint.value = presentAngle(first);
    movingTogether.value = group;
    motion.value = { phase: "on", uid: first, lease, torque: "on", others };
  } catch (error) {
    if (!still()) return;
    end();
    throw error;
  }
}

async function addToLease(lease: string, uids: readonly string[]): Promise<void> {
  await callApi("PUT", "/leases/{lease_id}", { path: { lease_id: lease }, body: { uids } });
}

function keep(lease: string): void {
  haveLease(lease);
  startBeat(lease);
}

/** Hold a lease passed by another client; torque stays off until turned on. */
export function hold(uid: string, lease: string): void {
  motionRefusal.value = null;
  keep(lease);
  motion.value = { phase: "held", uid, lease };
}

/** Refuse a request for motion control. */
export async function keepMotion(request: string): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on" && present.phase !== "held") return;
  try {
    await callApi("POST", "/leases/requests/{request_id}/refuse", {
      path: { request_id: request },
      headers: { Lease: present.lease },
    });
  } catch (error) {
    motionRefusal.value = problemText(problemOf(error));
  }
}

/** End motion: torque off, lease released. Continues while the page unloads. */
export function endMotion(why: string | null): void {
  const present = motion.peek();
  if (present.phase === "on") for (const uid of membersOf(present)) void torqueOff(uid, present.lease);
  forgetMotion(why);
}

/** All servos with torque on by this page. */
export function membersOf(present: Motion): readonly string[] {
  return present.phase === "on" ? [present.uid, ...present.others] : [];
}

async function energise(members: readonly string[], group: Together | null, lease: string): Promise<void> {
  // In sequence: the first refusal is reported, and the rest stays off.
  for (const uid of members) {
    forget(uid);
    await torque(uid, "on", lease);
  }
  await group?.begin(lease);
}

/** End motion where Stop or the server already handles torque; the lease is only released, unless `gone`. */
export function forgetMotion(why: string | null, gone = false): void {
  const present = motion.peek();
  if (present.phase === "off") return;
  stopBeat();
  drags.cancel();
  dragSpan.value = null;
  setpoint.value = null;
  question.value = null;
  warnings.value = [];
  movingTogether.value = null;
  motion.value = { phase: "off", why };
  if (!gone && (present.phase === "on" || present.phase === "held")) void giveBack(present.lease);
  if (present.phase === "waiting") void withdraw(present.request);
}

async function giveBack(lease: string): Promise<void> {
  haveLease(lease);
  await callApi("DELETE", "/leases/{lease_id}", { path: { lease_id: lease }, keepalive: true }).catch(
    () => undefined,
  );
}

/** Withdraw the request, and release the lease if it was granted meanwhile. */
export async function withdraw(request: string): Promise<void> {
  const end = await callApi("DELETE", "/leases/requests/{request_id}", {
    path: { request_id: request },
    keepalive: true,
  }).catch(() => null);
  if (end?.lease_id) await giveBack(end.lease_id);
}

async function release(members: readonly string[], lease: string): Promise<void> {
  for (const uid of members) void torqueOff(uid, lease);
  await giveBack(lease);
}

/** Not awaited while leaving; the result is tracked. Needs no lease. */
function torqueOff(uid: string, lease: string): Promise<void> {
  const options = { body: { mode: "off" as const }, headers: { Lease: lease }, keepalive: true };
  return followRelease(uid, callApi("POST", "/servos/{uid}/torque", { path: { uid }, ...options }));
}

function torque(uid: string, mode: TorqueMode, lease: string): Promise<Reading> {
  return callApi("POST", "/servos/{uid}/torque", {
    path: { uid },
    body: { mode },
    headers: { Lease: lease },
  });
}

/** Torque on or off during motion. Off never waits. */
export async function setTorque(mode: "on" | "off"): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on") return;
  drags.cancel();
  motionRefusal.value = null;
  warnings.value = [];
  try {
    const members = membersOf(present);
    if (mode === "on") await energise(members, movingTogether.peek(), present.lease);
    else await allOff(members, present.lease);
    const now = motion.peek();
    if (now.phase !== "on" || now.lease !== present.lease) return;
    setpoint.value = mode === "on" ? presentAngle(present.uid) : null;
    motion.value = { ...present, torque: mode };
  } catch (error) {
    // Half a group under torque is worse than none.
    if (mode === "on") for (const uid of membersOf(present)) void torqueOff(uid, present.lease);
    motionRefusal.value = problemText(problemOf(error));
  }
}

/** Torque off for all. A servo without a response is reported, and the others still count as off. */
async function allOff(members: readonly string[], lease: string): Promise<void> {
  const requested = members.map(uid => {
    const reported = torque(uid, "off", lease);
    if (members.length > 1) void followRelease(uid, reported);
    return reported;
  });
  const failed = (await Promise.allSettled(requested)).filter(one => one.status === "rejected");
  const first = failed[0];
  if (first !== undefined && failed.length === members.length) throw first.reason;
  motionRefusal.value = first === undefined ? null : problemText(problemOf(first.reason));
}

export function profileOf(speed: number | null): MotionProfile | null {
  return speed === null ? null : { speed_deg_s: speed, accel_deg_s2: speed / SPEED_UP_S };
}

/** One angle command over REST: the response has the angle sent. `confirm`: accepted words. */
export async function moveTo(angle: number, confirm: readonly string[] = []): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on") return;
  drags.cancel();
  motionRefusal.value = null;
  question.value = null;
  const before = setpoint.peek();
  setpoint.value = angle;
  const limited = profileOf(pace.peek());
  try {
    const group = movingTogether.peek();
    if (group) {
      warnings.value = (await group.move(angle, present.lease, limited)).warnings ?? [];
      return;
    }
    const response = await callApi("POST", "/servos/{uid}/command", {
      path: { uid: present.uid },
      body: {
        type: "angle",
        value: angle,
        ...(limited ? { profile: limited } : {}),
        ...(confirm.length > 0 ? { confirm: confirm as readonly NonNullable<Caution["confirm"]>[] } : {}),
      },
      headers: { Lease: present.lease },
    });
    if (setpoint.peek() === angle) setpoint.value = response.value;
    warnings.value = response.warnings ?? [];
  } catch (error) {
    const problem = problemOf(error);
    if (problem.code !== "needs_confirmation") {
      motionRefusal.value = problemText(problem);
      return;
    }
    if (setpoint.peek() === angle) setpoint.value = before;
    await putQuestion(present.uid, angle, problem);
  }
}

/** The consequences in the server's sentences, one per word to confirm. */
async function putQuestion(uid: string, angle: number, problem: Problem): Promise<void> {
  const words = Array.isArray(problem.facts.words) ? problem.facts.words.map(String) : [];
  const options = { path: { uid }, query: { type: "angle" as const, value: angle } };
  const found = await callApi("GET", "/servos/{uid}/cautions", options).catch((): Caution[] => []);
  const cautions = found
    .filter(one => one.confirm !== null && words.includes(one.confirm))
    .map(one => cautionText(one, uid));
  if (motion.peek().phase !== "on") return;
  question.value = { angle, words, cautions: cautions.length > 0 ? cautions : [problemText(problem)] };
}

const drags = new Newest<number>(DRAG_PERIOD_MS, angle => {
  const present = motion.peek();
  if (present.phase !== "on") return;
  const limited = profileOf(pace.peek());
  const group = movingTogether.peek();
  if (group) group.drag(angle, present.lease, limited);
  else
    live.send({
      type: "command",
      lease: present.lease,
      commands: [{ uid: present.uid, type: "angle", value: angle, profile: limited, hold: null }],
    });
});

/** An angle command of a drag, over the socket: the newest wins, at most thirty a second. */
export function dragTo(angle: number): void {
  if (motion.peek().phase !== "on" || question.peek() !== null) return;
  motionRefusal.value = null;
  warnings.value = [];
  setpoint.value = angle;
  drags.put(angle);
}

export function presentAngle(uid: string): number | null {
  const one = peekServo(uid);
  const reported = one ? angleOf(one, monotonic()) : telemetry.latest(uid, "current_angle", monotonic());
  return reported?.value ?? null;
}

/** The lease ended or passed, so the server turns torque off. The new holder is reported shortly after. */
function lost(): void {
  const present = motion.peek();
  const members = present.phase === "held" ? [present.uid] : membersOf(present);
  for (const uid of membersOf(present)) void followRelease(uid);
  forgetMotion(takenBy(members) ?? text.motion.endedLease, true);
  const before = motion.peek();
  const end = leases.subscribe(() => {
    const why = takenBy(members);
    if (why !== null && motion.peek() === before) motion.value = { phase: "off", why };
  });
  setTimeout(end, PASSING_MS);
}

function takenBy(members: readonly string[]): string | null {
  const other = leases.peek().find(one => covers(one, members) && !isOurs(one));
  return other ? text.motion.endedByOther(who(other.holder)) : null;
}

/** Connect every event that ends motion. */
export function startMotion(): void {
  onLeave(() => endMotion(null));
  addEventListener("pagehide", () => endMotion(null));
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) endMotion(text.motion.endedByHiding);
  });
  onRefusal(error => {
    const present = motion.peek();
    if (present.phase !== "on" && present.phase !== "held") return;
    const wanted = setpoint.peek();
    if (error.code === "unknown_lease" || error.code === "lease_required") lost();
    // The response to a drag has no words to confirm: the same command over REST does.
    else if (error.code === "needs_confirmation" && wanted !== null && error.uid === present.uid) {
      if (question.peek() === null) void moveTo(wanted);
    } else motionRefusal.value = failureText(error);
  });
  effect(() => {
    if (!up.value) endMotion(text.motion.endedByLink);
  });
  effect(() => {
    if (stopped.value) forgetMotion(text.motion.endedByStop);
  });
  effect(() => {
    if (stopInSight.value) return undefined;
    const late = setTimeout(() => {
      if (!stopSeen()) endMotion(text.motion.endedByHiddenStop);
    }, HIDDEN_MS);
    return () => clearTimeout(late);
  });
  effect(() => {
    const mine = leases.value.some(isOurs);
    const present = motion.peek();
    // Our lease has ended or passed: request it, because an older message may still arrive.
    if (!mine && (present.phase === "on" || present.phase === "held"))
      live.send({ type: "heartbeat", lease: present.lease });
  });
}
