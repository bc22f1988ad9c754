/** Several servos that move as one: who may, how far apart they stand, and the stream that tells them together. */

import { signal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Commanded, Stream } from "../api/types";
import { problemText } from "../bench/facts";
import { all, type KnownServo, nameOf } from "../bench/fleet";
import { live } from "../bench/link";
import {
  enableMotion,
  type MotionProfile,
  motion,
  motionRefusal,
  presentAngle,
  type Together,
} from "../bench/motion";
import { type Poll, poll } from "../bench/poll";
import type { Limits } from "../bench/servo-condition";
import { limitsOf } from "../bench/servo-condition";
import { jogging as words } from "./words";

/** Ticked to move with the servo of the page, before motion is on. */
export const chosenCompanions = signal<readonly string[]>([]);

/** "same": one angle for all. "apart": each keeps its distance from the first. */
export type Manner = "same" | "apart";
export const manner = signal<Manner>("same");

/** How far each stands from the first, degrees; the first at 0. */
export const offsets = signal<ReadonlyMap<string, number>>(new Map());

/** The stream as last heard of. */
export const stream = signal<Stream | null>(null);

const RATE_HZ = 50;
const LOOK_MS = 500;

/** Why a servo cannot be commanded in one message with others; null when it can. */
export function against(one: KnownServo): string | null {
  const name = nameOf(one);
  if (!one.online || one.state !== "ready") return words.notReady(name);
  if (one.servo_id === null || one.servo_id === 0) return words.noServoId(name);
  const twin = all.value.find(other => other !== one && other.online && other.servo_id === one.servo_id);
  if (twin && twin.uid !== one.uid) return words.sameServoId(name, nameOf(twin), one.servo_id);
  return one.position_unit.state === "conflict" ? words.unitConflict(name) : null;
}

/** Where the first may be commanded so that each of them stays within its own limits; null while one is not known. */
export function limitsOfAll(uids: readonly string[]): Limits | null {
  let cw = Number.POSITIVE_INFINITY;
  let ccw = Number.NEGATIVE_INFINITY;
  for (const uid of uids) {
    const own = limitsOf(uid);
    if (own === null) return null;
    const offset = offsets.value.get(uid) ?? 0;
    cw = Math.min(cw, own.cw - offset);
    ccw = Math.max(ccw, own.ccw - offset);
  }
  return cw < ccw ? null : { cw: tenth(cw), ccw: tenth(ccw) };
}

/** One angle for all, or the distances as they are now. */
export function setManner(next: Manner, uids: readonly string[]): void {
  manner.value = next;
  const first = uids[0];
  const from = first === undefined ? null : presentAngle(first);
  const apart = uids.map((uid): [string, number] => {
    const at = presentAngle(uid);
    return [uid, next === "same" || at === null || from === null ? 0 : tenth(at - from)];
  });
  offsets.value = new Map(apart);
}

/** Turns motion on for all of them: each holds where it stands, and from then on they are told together. */
export async function enableGroup(uid: string, others: readonly string[]): Promise<void> {
  const uids = [uid, ...others];
  setManner(manner.peek(), uids);
  stream.value = null;
  await enableMotion(uid, others, togetherOf(uids));
}

function togetherOf(uids: readonly string[]): Together {
  let look: Poll | null = null;
  const goals = (angle: number) =>
    Object.fromEntries(uids.map(uid => [uid, tenth(angle + (offsets.peek().get(uid) ?? 0))]));
  const id = () => stream.peek()?.id ?? "";
  return {
    async begin(lease) {
      const body = { uids, type: "angle" as const, rate_hz: RATE_HZ };
      stream.value = await ask("POST", "/streams", { body, headers: { Lease: lease } });
      look?.end();
      look = poll(LOOK_MS, async () => {
        if (motion.peek().phase === "off") return look?.end();
        await lookAt(id());
      });
    },
    async move(angle, lease, profile) {
      await put(goals(angle), lease, profile);
      return { warnings: [] } as unknown as Commanded;
    },
    drag(angle, lease, profile) {
      live.send({ type: "stream", lease, id: id(), values: goals(angle), profile });
    },
  };
}

async function put(
  values: Record<string, number>,
  lease: string,
  profile: MotionProfile | null,
): Promise<void> {
  stream.value = await ask("PUT", "/streams/{stream_id}", {
    path: { stream_id: stream.peek()?.id ?? "" },
    body: { values, profile },
    headers: { Lease: lease },
  });
}

/** How the stream is now. One that ended says why, with the name of whoever ended it. */
async function lookAt(id: string): Promise<void> {
  const answer = await ask("GET", "/streams/{stream_id}", { path: { stream_id: id } }).catch(() => null);
  if (answer === null || stream.peek()?.id !== answer.id) return;
  const found: Stream = { ...answer, ended: answer.ended_summary ?? null };
  const before = stream.peek();
  stream.value = found;
  const present = motion.peek();
  // Of a group whose torque we took ourselves it is no news, and who did not answer then is.
  if (found.ended && before?.ended === null && present.phase === "on" && present.torque !== "off")
    motionRefusal.value = words.ended(found.ended);
}

/** Holds all where they are and goes on from there, after one of them ended it. */
export async function beginAgain(group: Together): Promise<void> {
  const present = motion.peek();
  if (present.phase !== "on") return;
  motionRefusal.value = null;
  try {
    await group.begin(present.lease);
  } catch (error) {
    motionRefusal.value = problemText(problemOf(error));
  }
}

function tenth(value: number): number {
  return Math.round(value * 10) / 10;
}
