/** The sweep: there and back, so many times, at a limited speed; it lives on this page and ends with it. */

import { effect, signal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Commanded } from "../api/types";
import { problemText } from "../bench/facts";
import { peekServo } from "../bench/fleet";
import { angle as angleText } from "../bench/format";
import { freshAngle } from "../bench/fresh";
import {
  membersOf,
  motion,
  movingTogether,
  presentAngle,
  profileOf,
  question,
  setpoint,
} from "../bench/motion";
import { offsets, stream } from "./group";
import { jogging as words } from "./words";

export interface SweepWish {
  from: number;
  to: number;
  /** Degrees a second. */
  speed: number;
  /** At each end, seconds. */
  pause_s: number;
  /** There and back is one. */
  count: number;
}

export interface Sweep extends SweepWish {
  /** How often it has been there and back. */
  done: number;
  /** Where it goes now. */
  goal: number;
}

export const sweep = signal<Sweep | null>(null);

/** How the last one ended. */
export const sweepSaid = signal<string | null>(null);

/** Nearer than this is there. */
const BAND_DEG = 1.5;
const LOOK_MS = 50;
/** A leg that takes so much longer than reckoned is not going to arrive. */
const PATIENCE = 2;
const PATIENCE_S = 4;

let round = 0;

/** About how long it takes, seconds: the ways at their speed, half a second to get going and to brake, the pauses. */
export function sweepLasts(wish: SweepWish): number {
  const leg = Math.abs(wish.to - wish.from) / wish.speed + 0.5 + wish.pause_s;
  return 2 * wish.count * leg;
}

/** Sweeps until it is done or ended. Anything that ends motion ends it, and so does a leg that does not arrive. */
export async function startSweep(wish: SweepWish): Promise<void> {
  if (sweep.peek() !== null || motion.peek().phase !== "on") return;
  round += 1;
  const mine = round;
  const still = () => round === mine && sweep.peek() !== null;
  sweepSaid.value = null;
  sweep.value = { ...wish, done: 0, goal: wish.from };
  const stopWatching = effect(() => {
    const present = motion.value;
    if (present.phase !== "on" || present.torque !== "on" || question.value !== null) over(words.sweepEnded);
  });
  try {
    await leg(wish.from, wish, still);
    for (let done = 0; done < wish.count && still(); done += 1) {
      sweep.value = { ...wish, done, goal: wish.to };
      await leg(wish.to, wish, still);
      await pause(wish.pause_s, still);
      if (!still()) return;
      sweep.value = { ...wish, done, goal: wish.from };
      await leg(wish.from, wish, still);
      if (done + 1 < wish.count) await pause(wish.pause_s, still);
    }
    if (still()) over(words.sweepDone(wish.count));
  } catch (error) {
    if (still())
      over(words.sweepFailed(error instanceof NotThere ? error.message : problemText(problemOf(error))));
  } finally {
    stopWatching();
  }
}

/** Ends it where the horns are: they are told to hold there. */
export async function endSweep(): Promise<void> {
  const going = sweep.peek();
  const present = motion.peek();
  if (going === null) return;
  over(words.sweepStopped(going.done));
  if (present.phase !== "on") return;
  const heard = presentAngle(present.uid);
  if (heard === null) return;
  const at = Math.round(heard * 10) / 10; // a step of the register
  setpoint.value = at;
  const group = movingTogether.peek();
  await (group
    ? group.move(at, present.lease, profileOf(going.speed))
    : command(present, at, going.speed)
  ).catch(() => undefined);
}

function over(said: string): void {
  if (sweep.peek() === null) return;
  round += 1;
  sweep.value = null;
  sweepSaid.value = said;
}

class NotThere extends Error {}

async function leg(angle: number, wish: SweepWish, still: () => boolean): Promise<void> {
  const present = motion.peek();
  if (!still() || present.phase !== "on") return;
  setpoint.value = angle;
  const group = movingTogether.peek();
  const deadline = performance.now() + 1000 * patience(present.uid, angle, wish.speed);
  if (group) await group.move(angle, present.lease, profileOf(wish.speed));
  else await command(present, angle, wish.speed);
  const members = membersOf(present);
  while (still()) {
    const ended = stream.peek()?.ended;
    if (group && ended) throw new NotThere(ended);
    if (members.every(uid => near(uid, angle + (group ? (offsets.peek().get(uid) ?? 0) : 0)))) return;
    if (performance.now() > deadline) throw new NotThere(words.notReached(angleText(angle)));
    await new Promise(resolve => setTimeout(resolve, LOOK_MS));
  }
}

/** Whether the horn was there, as heard a moment ago; one that is silent is not. */
function near(uid: string, goal: number): boolean {
  const value = freshAngle(peekServo(uid));
  return value !== null && Math.abs(value - goal) < BAND_DEG;
}

function command(present: { uid: string; lease: string }, angle: number, speed: number): Promise<Commanded> {
  return ask("POST", "/servos/{uid}/command", {
    path: { uid: present.uid },
    body: { type: "angle", value: angle, profile: profileOf(speed) },
    headers: { Lease: present.lease },
  });
}

/** How long a leg may take, seconds. */
function patience(uid: string, angle: number, speed: number): number {
  return (PATIENCE * Math.abs(angle - (presentAngle(uid) ?? 0))) / speed + PATIENCE_S;
}

async function pause(seconds: number, still: () => boolean): Promise<void> {
  const end = performance.now() + 1000 * seconds;
  while (still() && performance.now() < end) {
    await new Promise(resolve => setTimeout(resolve, Math.min(50, end - performance.now())));
  }
}
