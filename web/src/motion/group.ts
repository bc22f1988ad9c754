/** Several servos that move together: eligibility, offsets between them, and the setpoint stream that commands them. */

import { signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
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
import { noteText } from "../bench/note-text";
import { type Poll, poll } from "../bench/poll";
import type { Limits } from "../bench/servo-condition";
import { limitsOf } from "../bench/servo-condition";
import { jogging as words } from "./words";

/** Servos selected to move with the servo of the page, before motion is on. */
export const chosenCompanions = signal<readonly string[]>([]);

/** "same": one angle for all. "apart": each servo keeps its offset from the first one. */
export type GroupMode = "same" | "apart";
export const groupMode = signal<GroupMode>("same");

/** Offset of each servo from the first one, degrees; 0 for the first one. */
export const offsets = signal<ReadonlyMap<string, number>>(new Map());

/** The stream as last reported. */
export const stream = signal<Stream | null>(null);

const RATE_HZ = 50;
const POLL_MS = 500;

/** Why a servo cannot be commanded in one message with others; null if it can. */
export function against(one: KnownServo): string | null {
  const name = nameOf(one);
  if (!one.online || one.state !== "ready") return words.notReady(name);
  if (one.servo_id === null || one.servo_id === 0) return words.noServoId(name);
  const twin = all.value.find(other => other !== one && other.online && other.servo_id === one.servo_id);
  if (twin && twin.uid !== one.uid) return words.sameServoId(name, nameOf(twin), one.servo_id);
  return one.position_unit.state === "conflict" ? words.unitConflict(name) : null;
}

/** Angles of the first servo at which every servo is within its own limits; null while a limit is unknown. */
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

/** Set all offsets to 0, or to the present differences. */
export function setGroupMode(next: GroupMode, uids: readonly string[]): void {
  groupMode.value = next;
  const first = uids[0];
  const from = first === undefined ? null : presentAngle(first);
  const apart = uids.map((uid): [string, number] => {
    const at = presentAngle(uid);
    return [uid, next === "same" || at === null || from === null ? 0 : tenth(at - from)];
  });
  offsets.value = new Map(apart);
}

/** Turn motion on for all of them. Each holds its position; from then on they are commanded together. */
export async function enableGroup(uid: string, others: readonly string[]): Promise<void> {
  const uids = [uid, ...others];
  setGroupMode(groupMode.peek(), uids);
  stream.value = null;
  await enableMotion(uid, others, togetherOf(uids));
}

function togetherOf(uids: readonly string[]): Together {
  let polling: Poll | null = null;
  const goals = (angle: number) =>
    Object.fromEntries(uids.map(uid => [uid, tenth(angle + (offsets.peek().get(uid) ?? 0))]));
  const id = () => stream.peek()?.id ?? "";
  return {
    async begin(lease) {
      const body = { uids, type: "angle" as const, rate_hz: RATE_HZ };
      stream.value = await callApi("POST", "/streams", { body, headers: { Lease: lease } });
      polling?.end();
      polling = poll(POLL_MS, async () => {
        if (motion.peek().phase === "off") return polling?.end();
        await readStream(id());
      });
    },
    async move(angle, lease, profile, signal) {
      await put(goals(angle), lease, profile, signal);
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
  signal?: AbortSignal,
): Promise<void> {
  stream.value = await callApi("PUT", "/streams/{stream_id}", {
    path: { stream_id: stream.peek()?.id ?? "" },
    body: { values, profile },
    headers: { Lease: lease },
    signal,
  });
}

/** Read the state of the stream. If it ended, its reason names the client that ended it. */
async function readStream(id: string): Promise<void> {
  const found = await callApi("GET", "/streams/{stream_id}", { path: { stream_id: id } }).catch(() => null);
  if (found === null || stream.peek()?.id !== found.id) return;
  const next: Stream = {
    ...found,
    ended: found.ended && noteText(found.ended, found.ended_code, found.ended_params),
  };
  const before = stream.peek();
  stream.value = next;
  const present = motion.peek();
  // After this page turned torque off, the end of the stream is expected; a missing response then is not.
  if (next.ended && before?.ended === null && present.phase === "on" && present.torque !== "off")
    motionRefusal.value = words.ended(next.ended);
}

/** Hold all servos at their present angles and restart the stream, after it ended. */
export async function restartGroup(group: Together): Promise<void> {
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
