/** Owns motion from this page: one lease, its heart-beat, torque, commands; and that all of it ends. */
import { effect, signal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Commanded, Lease, Reading, TorqueMode } from "../api/types";
import { telemetry } from "../telemetry/store";
import { text } from "../text/en";
import { monotonic } from "./clock";
import { lease as heldLease, stopped } from "./desk";
import { angleOf, peekServo } from "./fleet";
import { live, onRefusal, up } from "./link";
import { Newest } from "./newest";
import { onLeave } from "./route";

export type Motion =
  | { phase: "off"; why: string | null }
  | { phase: "asking"; uid: string }
  | { phase: "on"; uid: string; lease: string; torque: TorqueMode };

export const motion = signal<Motion>({ phase: "off", why: null });

/** The angle last asked for, degrees; null until something was. */
export const setpoint = signal<number | null>(null);

/** Why the last command or request was refused, in words. */
export const refusal = signal<string | null>(null);

const TTL_S = 3;
const BEAT_MS = 1000;
const DRAG_PERIOD_MS = 1000 / 30;

let beat: ReturnType<typeof setInterval> | undefined;

/** A name for this tab, the same as long as it lives, so that others can tell who moves what. */
export function holder(): string {
  const key = "hornbill.tab";
  try {
    const kept = sessionStorage.getItem(key) ?? String(1 + Math.floor(Math.random() * 999));
    sessionStorage.setItem(key, kept);
    return text.motion.holder(kept);
  } catch {
    return text.motion.holder("1");
  }
}

/** Takes the lease and turns torque on. Nothing moves: the servo holds where it stands. */
export async function enableMotion(uid: string): Promise<void> {
  if (motion.peek().phase !== "off") return;
  motion.value = { phase: "asking", uid };
  refusal.value = null;
  try {
    const lease = await ask<Lease>("POST", "/leases", { body: { holder: holder(), ttl_s: TTL_S } });
    if (motion.peek().phase !== "asking") {
      await release(uid, lease.id);
      return;
    }
    startBeat(lease.id);
    try {
      await torque(uid, "on", lease.id);
    } catch (error) {
      await release(uid, lease.id);
      throw error;
    }
    if (motion.peek().phase !== "asking") {
      await release(uid, lease.id);
      return;
    }
    setpoint.value = presentAngle(uid);
    motion.value = { phase: "on", uid, lease: lease.id, torque: "on" };
  } catch (error) {
    stopBeat();
    refusal.value = text.problem(problemOf(error));
    if (motion.peek().phase === "asking") motion.value = { phase: "off", why: null };
  }
}

/** Ends motion: torque off, lease given back. Lives on while the page goes away. */
export function endMotion(why: string | null): void {
  const present = motion.peek();
  if (present.phase === "on") void torqueOff(present.uid);
  forgetMotion(why);
}

/** Ends motion where torque is already taken care of, by Stop or by the server; only the lease is given back. */
export function forgetMotion(why: string | null): void {
  const present = motion.peek();
  if (present.phase === "off") return;
  stopBeat();
  drags.cancel();
  setpoint.value = null;
  motion.value = { phase: "off", why };
  if (present.phase === "on") {
    void ask<void>("DELETE", `/leases/${present.lease}`, { keepalive: true }).catch(() => undefined);
  }
}

async function release(uid: string, lease: string): Promise<void> {
  stopBeat();
  await Promise.allSettled([torqueOff(uid), ask<void>("DELETE", `/leases/${lease}`, { keepalive: true })]);
}

function torqueOff(uid: string): Promise<unknown> {
  return ask<Reading>("POST", `/servos/${uid}/torque`, { body: { mode: "off" }, keepalive: true }).catch(
    () => undefined,
  );
}

function torque(uid: string, mode: TorqueMode, lease: string): Promise<Reading> {
  return ask<Reading>("POST", `/servos/${uid}/torque`, { body: { mode }, headers: { Lease: lease } });
}

/** Torque on or off while motion is on. Off never waits for anything. */
export async function setTorque(mode: "on" | "off"): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on") return;
  drags.cancel();
  refusal.value = null;
  try {
    await torque(present.uid, mode, present.lease);
    if (motion.peek().phase !== "on") return;
    setpoint.value = mode === "on" ? presentAngle(present.uid) : null;
    motion.value = { ...present, torque: mode };
  } catch (error) {
    refusal.value = text.problem(problemOf(error));
  }
}

/** One angle command, over REST: its answer says what was really sent. */
export async function moveTo(angle: number): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on") return;
  drags.cancel();
  refusal.value = null;
  setpoint.value = angle;
  try {
    const answer = await ask<Commanded>("POST", `/servos/${present.uid}/command`, {
      body: { type: "angle", value: angle },
      headers: { Lease: present.lease },
    });
    if (setpoint.peek() === angle) setpoint.value = answer.value;
  } catch (error) {
    refusal.value = text.problem(problemOf(error));
  }
}

const drags = new Newest<number>(DRAG_PERIOD_MS, angle => {
  const present = motion.peek();
  if (present.phase !== "on") return;
  live.send({
    type: "command",
    lease: present.lease,
    commands: [{ uid: present.uid, type: "angle", value: angle }],
  });
});

/** An angle command of a drag, over the socket: the newest wins, at most thirty a second. */
export function dragTo(angle: number): void {
  if (motion.peek().phase !== "on") return;
  refusal.value = null;
  setpoint.value = angle;
  drags.put(angle);
}

function presentAngle(uid: string): number | null {
  const one = peekServo(uid);
  const told = one ? angleOf(one, monotonic()) : telemetry.latest(uid, "current_angle", monotonic());
  return told?.value ?? null;
}

function startBeat(lease: string): void {
  stopBeat();
  const send = () => live.send({ type: "heartbeat", lease });
  send();
  beat = setInterval(send, BEAT_MS);
}

function stopBeat(): void {
  clearInterval(beat);
  beat = undefined;
}

async function checkLease(lease: string): Promise<void> {
  try {
    await ask<Lease>("PUT", `/leases/${lease}`);
  } catch (error) {
    const present = motion.peek();
    if (present.phase === "on" && present.lease === lease)
      forgetMotion(text.motion.endedBy(text.problem(problemOf(error))));
  }
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
    if (present.phase !== "on") return;
    refusal.value = error.detail;
    if (error.code === "unknown_lease" || error.code === "lease_required") forgetMotion(error.detail);
  });
  effect(() => {
    if (!up.value) endMotion(text.motion.endedByLink);
  });
  effect(() => {
    if (stopped.value) forgetMotion(text.motion.endedByStop);
  });
  effect(() => {
    const mine = heldLease.value?.holder === holder();
    const present = motion.peek();
    // Ours is over or somebody else's: ask rather than guess, for an older message may still be on its way.
    if (!mine && present.phase === "on") void checkLease(present.lease);
  });
}
