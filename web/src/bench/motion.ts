/** Motion from this page: one lease, its heart-beat, torque, commands; and that all of it ends. */

import { effect, signal } from "@preact/signals";
import { ask, type Problem, problemOf } from "../api/client";
import type { Caution, Commanded, LeaseView, Reading, TorqueMode } from "../api/types";
import { telemetry } from "../telemetry/store";
import { text } from "../text";
import { lease as heldLease, stopped } from "./bench";
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
  | { phase: "asking"; uid: string }
  /** Somebody else has motion control and was asked for it; it passes at `endsAt`, on our monotonic clock. */
  | { phase: "waiting"; uid: string; request: string; from: string; endsAt: number }
  /** Motion control is ours and torque is off: it came later than it was asked for, so nothing begins by itself. */
  | { phase: "held"; uid: string; lease: string }
  | { phase: "on"; uid: string; lease: string; torque: TorqueMode; others: readonly string[] };

export const motion = signal<Motion>({ phase: "off", why: null });

/** The angle last asked for, degrees; null until something was. */
export const setpoint = signal<number | null>(null);

/** Why the last command or request was refused, in words. */
export const motionRefusal = signal<string | null>(null);

/** What the server said beside the last command. */
export const warnings = signal<readonly string[]>([]);

export interface MotionQuestion {
  angle: number;
  /** The words that say "do it". */
  words: readonly string[];
  said: readonly string[];
}

/** A move that is not made before somebody has agreed to what will happen. */
export const question = signal<MotionQuestion | null>(null);

/** Whose horn may be dragged now, and within what: set where the jog pad's own dial can be, and by it alone. */
export const dragSpan = signal<{ uid: string; limits: { ccw: number; cw: number } } | null>(null);

export interface MotionProfile {
  speed_deg_s: number;
  accel_deg_s2: number;
}

/** Servos that are commanded in one message with this one: how, is for the part of the page that began it. */
export interface Together {
  /** Holds all where they are, under the lease; torque is on. */
  begin: (lease: string) => Promise<void>;
  move: (angle: number, lease: string, profile: MotionProfile | null) => Promise<Commanded>;
  drag: (angle: number, lease: string, profile: MotionProfile | null) => void;
}

export const movingTogether = signal<Together | null>(null);

/** How a jog goes: at a limited speed in degrees a second, or (null) as fast as the servo can. */
export const pace = signal<number | null>(60);
/** A jog is at its speed after a quarter of a second. */
const SPEED_UP_S = 0.25;

export const TTL_S = 3;
/** A lease that passes is nobody's for a quarter of a second; who has it may be told later still. */
const PASSING_MS = 3000;
/** Stop may be out of sight for so long while a window or a keyboard changes its size. */
const HIDDEN_MS = 300;
const DRAG_PERIOD_MS = 1000 / 30;

/** Whether somebody else has this lease. Who is about to get one is not told of it by its own number yet. */
export function isOfOther(view: LeaseView): boolean {
  return motion.value.phase !== "asking" && !isOurs(view);
}

/** The header of the lease this page moves under; none while it moves nothing. */
export function leaseHeader(): Record<string, string> {
  const held = motion.peek();
  return held.phase === "on" ? { Lease: held.lease } : {};
}

/** Takes the lease and turns torque on. Nothing moves: the servo holds where it stands, and so do `others` with it. */
export async function enableMotion(
  uid: string,
  others: readonly string[] = [],
  group: Together | null = null,
): Promise<void> {
  if (!stopSeen()) {
    motionRefusal.value = text.motion.stopHidden;
    return;
  }
  const members = [uid, ...others];
  try {
    await takeControl(uid, members, group, async lease => {
      await energise(members, group, lease);
      return members;
    });
  } catch (error) {
    motionRefusal.value = problemText(problemOf(error));
  }
}

/**
 * Takes the lease, or goes on with the one that is ours. Those whose output `switchOn` answers to have switched on are
 * under command from then on. If it was given up meanwhile, or none is, the lease is given back, and `off` are written
 * torque off; whoever else it switched on is let go by the server. Throws what went wrong.
 */
export async function takeControl(
  uid: string,
  off: readonly string[],
  group: Together | null,
  switchOn: (lease: string) => Promise<readonly string[]>,
): Promise<void> {
  const before = motion.peek();
  if (before.phase !== "off" && before.phase !== "held") return;
  const asking: Motion = { phase: "asking", uid };
  // Given up, and perhaps asked for anew since: then this is not ours to go on with.
  const still = () => motion.peek() === asking;
  motion.value = asking;
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
        : (await ask("POST", "/leases", { body: { holder: holder(), ttl_s: TTL_S } })).id;
    if (!still()) {
      await release(off, lease);
      return;
    }
    keep(lease);
    let on: readonly string[];
    try {
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

function keep(lease: string): void {
  haveLease(lease);
  startBeat(lease);
}

/** Keeps a lease that somebody else gave or lost; torque stays off until it is turned on. */
export function hold(uid: string, lease: string): void {
  motionRefusal.value = null;
  keep(lease);
  motion.value = { phase: "held", uid, lease };
}

/** Keeps motion control though somebody asks for it. */
export async function keepMotion(request: string): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on" && present.phase !== "held") return;
  try {
    await ask("POST", "/leases/requests/{request_id}/refuse", {
      path: { request_id: request },
      headers: { Lease: present.lease },
    });
  } catch (error) {
    motionRefusal.value = problemText(problemOf(error));
  }
}

/** Ends motion: torque off, lease given back. Lives on while the page goes away. */
export function endMotion(why: string | null): void {
  const present = motion.peek();
  if (present.phase === "on") for (const uid of membersOf(present)) void torqueOff(uid, present.lease);
  forgetMotion(why);
}

/** Everybody whose torque is on by this page. */
export function membersOf(present: Motion): readonly string[] {
  return present.phase === "on" ? [present.uid, ...present.others] : [];
}

async function energise(members: readonly string[], group: Together | null, lease: string): Promise<void> {
  // One after the other: the first that refuses is named, and nobody after it is energised.
  for (const uid of members) {
    forget(uid);
    await torque(uid, "on", lease);
  }
  await group?.begin(lease);
}

/** Ends motion where torque is already taken care of, by Stop or by the server; only the lease is given back, unless it is `gone`. */
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
  await ask("DELETE", "/leases/{lease_id}", { path: { lease_id: lease }, keepalive: true }).catch(
    () => undefined,
  );
}

/** Asks no more; what was granted meanwhile is given back. */
export async function withdraw(request: string): Promise<void> {
  const end = await ask("DELETE", "/leases/requests/{request_id}", {
    path: { request_id: request },
    keepalive: true,
  }).catch(() => null);
  if (end?.lease_id) await giveBack(end.lease_id);
}

async function release(members: readonly string[], lease: string): Promise<void> {
  for (const uid of members) void torqueOff(uid, lease);
  await giveBack(lease);
}

/** Not waited for by whoever leaves: what became of it is followed. The lease tells who it was; none is needed. */
function torqueOff(uid: string, lease: string): Promise<void> {
  const options = { body: { mode: "off" as const }, headers: { Lease: lease }, keepalive: true };
  return followRelease(uid, ask("POST", "/servos/{uid}/torque", { path: { uid }, ...options }));
}

function torque(uid: string, mode: TorqueMode, lease: string): Promise<Reading> {
  return ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mode }, headers: { Lease: lease } });
}

/** Torque on or off while motion is on. Off never waits for anything. */
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
    // Half a group that pulls is worse than none.
    if (mode === "on") for (const uid of membersOf(present)) void torqueOff(uid, present.lease);
    motionRefusal.value = problemText(problemOf(error));
  }
}

/** Everybody's torque off. One that does not answer is told of, and does not make the others count as on. */
async function allOff(members: readonly string[], lease: string): Promise<void> {
  const asked = members.map(uid => {
    const told = torque(uid, "off", lease);
    if (members.length > 1) void followRelease(uid, told);
    return told;
  });
  const failed = (await Promise.allSettled(asked)).filter(one => one.status === "rejected");
  const first = failed[0];
  if (first !== undefined && failed.length === members.length) throw first.reason;
  motionRefusal.value = first === undefined ? null : problemText(problemOf(first.reason));
}

export function profileOf(speed: number | null): MotionProfile | null {
  return speed === null ? null : { speed_deg_s: speed, accel_deg_s2: speed / SPEED_UP_S };
}

/** One angle command, over REST: its answer says what was really sent. `confirm`: what somebody has agreed to. */
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
    const answer = await ask("POST", "/servos/{uid}/command", {
      path: { uid: present.uid },
      body: {
        type: "angle",
        value: angle,
        ...(limited ? { profile: limited } : {}),
        ...(confirm.length > 0 ? { confirm: confirm as readonly NonNullable<Caution["confirm"]>[] } : {}),
      },
      headers: { Lease: present.lease },
    });
    if (setpoint.peek() === angle) setpoint.value = answer.value;
    warnings.value = answer.warnings ?? [];
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

/** Says what will happen in the server's sentences, one a word that is to be agreed to. */
async function putQuestion(uid: string, angle: number, problem: Problem): Promise<void> {
  const words = Array.isArray(problem.facts.words) ? problem.facts.words.map(String) : [];
  const options = { path: { uid }, query: { type: "angle" as const, value: angle } };
  const found = await ask("GET", "/servos/{uid}/cautions", options).catch((): Caution[] => []);
  const said = found
    .filter(one => one.confirm !== null && words.includes(one.confirm))
    .map(one => cautionText(one, uid));
  if (motion.peek().phase !== "on") return;
  question.value = { angle, words, said: said.length > 0 ? said : [problemText(problem)] };
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
  const told = one ? angleOf(one, monotonic()) : telemetry.latest(uid, "current_angle", monotonic());
  return told?.value ?? null;
}

/** The lease has ended or is somebody else's, so the server takes torque. Who has it is told a moment later. */
function lost(): void {
  for (const uid of membersOf(motion.peek())) void followRelease(uid);
  forgetMotion(takenBy() ?? text.motion.endedLease, true);
  const said = motion.peek();
  const end = heldLease.subscribe(() => {
    const why = takenBy();
    if (why !== null && motion.peek() === said) motion.value = { phase: "off", why };
  });
  setTimeout(end, PASSING_MS);
}

function takenBy(): string | null {
  const other = heldLease.peek();
  return other && !isOurs(other) ? text.motion.endedByOther(who(other.holder)) : null;
}

/** Ties motion to everything that ends it. */
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
    // The answer to a drag names no words to agree to: the same command over REST does.
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
    const mine = heldLease.value !== null && isOurs(heldLease.value);
    const present = motion.peek();
    // Ours is over or somebody else's: ask rather than guess, for an older message may still be on its way.
    if (!mine && (present.phase === "on" || present.phase === "held"))
      live.send({ type: "heartbeat", lease: present.lease });
  });
}
