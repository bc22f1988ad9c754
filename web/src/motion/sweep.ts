/** The sweep: a number of cycles between two angles at a limited speed. It runs in this page and ends with it. */

import { effect, signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
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

export interface SweepSettings {
  from: number;
  to: number;
  /** Speed, degrees per second. */
  speed: number;
  /** Pause at each end, seconds. */
  pause_s: number;
  /** Number of cycles, there and back. */
  count: number;
}

export interface Sweep extends SweepSettings {
  /** Number of completed cycles. */
  done: number;
  /** Present target angle. */
  goal: number;
}

export const sweep = signal<Sweep | null>(null);

/** Result of the last sweep. */
export const sweepResult = signal<string | null>(null);

/** Distance within which the target counts as reached. */
const BAND_DEG = 1.5;
const POLL_MS = 50;
/** Timeout of a leg: a multiple of its expected time, plus a constant. */
const TIMEOUT_FACTOR = 2;
const TIMEOUT_S = 4;

/** Ends the running sweep, and abandons its last command, which must not be sent afterwards. */
let running = new AbortController();

/** Approximate duration, seconds: travel at the given speed, half a second per leg to accelerate and brake, and the pauses. */
export function sweepDuration(settings: SweepSettings): number {
  const leg = Math.abs(settings.to - settings.from) / settings.speed + 0.5 + settings.pause_s;
  return 2 * settings.count * leg;
}

/** Run a sweep to its end. It also ends when motion ends or a leg times out. */
export async function startSweep(settings: SweepSettings): Promise<void> {
  if (sweep.peek() !== null || motion.peek().phase !== "on") return;
  running = new AbortController();
  const { signal } = running;
  sweepResult.value = null;
  sweep.value = { ...settings, done: 0, goal: settings.from };
  const stopWatching = effect(() => {
    const present = motion.value;
    if (present.phase !== "on" || present.torque !== "on" || question.value !== null) over(words.sweepEnded);
  });
  try {
    await leg(settings.from, settings, signal);
    for (let done = 0; done < settings.count && !signal.aborted; done += 1) {
      sweep.value = { ...settings, done, goal: settings.to };
      await leg(settings.to, settings, signal);
      await pause(settings.pause_s, signal);
      if (signal.aborted) return;
      sweep.value = { ...settings, done, goal: settings.from };
      await leg(settings.from, settings, signal);
      if (done + 1 < settings.count) await pause(settings.pause_s, signal);
    }
    if (!signal.aborted) over(words.sweepDone(settings.count));
  } catch (error) {
    if (!signal.aborted)
      over(words.sweepFailed(error instanceof NotReached ? error.message : problemText(problemOf(error))));
  } finally {
    stopWatching();
  }
}

/** End the sweep and command the horns to hold their present angles. */
export async function endSweep(): Promise<void> {
  const going = sweep.peek();
  const present = motion.peek();
  if (going === null) return;
  over(words.sweepStopped(going.done));
  if (present.phase !== "on") return;
  const angle = presentAngle(present.uid);
  if (angle === null) return;
  const at = Math.round(angle * 10) / 10; // a step of the register
  setpoint.value = at;
  const group = movingTogether.peek();
  await (group
    ? group.move(at, present.lease, profileOf(going.speed))
    : command(present, at, going.speed)
  ).catch(() => undefined);
}

function over(said: string): void {
  if (sweep.peek() === null) return;
  running.abort();
  sweep.value = null;
  sweepResult.value = said;
}

class NotReached extends Error {}

async function leg(angle: number, settings: SweepSettings, signal: AbortSignal): Promise<void> {
  const present = motion.peek();
  if (signal.aborted || present.phase !== "on") return;
  setpoint.value = angle;
  const group = movingTogether.peek();
  const deadline = performance.now() + 1000 * legTimeout(present.uid, angle, settings.speed);
  if (group) await group.move(angle, present.lease, profileOf(settings.speed), signal);
  else await command(present, angle, settings.speed, signal);
  const members = membersOf(present);
  while (!signal.aborted) {
    const ended = stream.peek()?.ended;
    if (group && ended) throw new NotReached(ended);
    if (members.every(uid => near(uid, angle + (group ? (offsets.peek().get(uid) ?? 0) : 0)))) return;
    if (performance.now() > deadline) throw new NotReached(words.notReached(angleText(angle)));
    await new Promise(resolve => setTimeout(resolve, POLL_MS));
  }
}

/** Whether the last fresh angle is near the goal; false for a silent servo. */
function near(uid: string, goal: number): boolean {
  const value = freshAngle(peekServo(uid));
  return value !== null && Math.abs(value - goal) < BAND_DEG;
}

function command(
  present: { uid: string; lease: string },
  angle: number,
  speed: number,
  signal?: AbortSignal,
): Promise<Commanded> {
  return callApi("POST", "/servos/{uid}/command", {
    path: { uid: present.uid },
    body: { type: "angle", value: angle, profile: profileOf(speed) },
    headers: { Lease: present.lease },
    signal,
  });
}

/** Timeout of a leg, seconds. */
function legTimeout(uid: string, angle: number, speed: number): number {
  return (TIMEOUT_FACTOR * Math.abs(angle - (presentAngle(uid) ?? 0))) / speed + TIMEOUT_S;
}

async function pause(seconds: number, signal: AbortSignal): Promise<void> {
  const end = performance.now() + 1000 * seconds;
  while (!signal.aborted && performance.now() < end) {
    await new Promise(resolve => setTimeout(resolve, Math.min(50, end - performance.now())));
  }
}
