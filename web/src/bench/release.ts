/** What is known of torque where motion of this page has ended: off, as the servo answered, or nobody knows. */
import { signal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Reading } from "../api/types";

/** "asking": no answer yet. "off": it answered so. "silent": it was asked and did not answer. */
export type ReleaseState = "asking" | "off" | "silent";

export const released = signal<ReadonlyMap<string, ReleaseState>>(new Map());

const AGAIN_MS = 1000;
/** One whose torque is on for so long after our motion ended is moved by somebody else. */
const OTHERS_MS = 3000;

const rounds = new Map<string, symbol>();

/** Those whose state is this one. */
export function those(state: ReleaseState): string[] {
  return [...released.value].flatMap(([uid, one]) => (one === state ? [uid] : []));
}

/** What was read of them is of no interest any more; who has not answered is asked on. */
export function forgetAnswered(): void {
  released.value = new Map([...released.peek()].filter(([, one]) => one !== "off"));
}

/** Torque is turned on, so off is not waited for. */
export function forget(uid: string): void {
  rounds.delete(uid);
  put(uid, null);
}

/** Waits for its answer to a torque off that was sent, `told`; without one asks what it holds until it answers. */
export async function followRelease(uid: string, told: Promise<Reading> = read(uid)): Promise<void> {
  const round = Symbol(uid);
  rounds.set(uid, round);
  put(uid, "asking");
  const began = performance.now();
  for (let answer = told; ; answer = read(uid)) {
    const found = await answer.catch(error => problemOf(error));
    if (rounds.get(uid) !== round) return;
    if ("value" in found && found.value !== "on") return put(uid, "off");
    const gone = "code" in found && found.code === "unknown_servo";
    if (gone || ("value" in found && performance.now() - began > OTHERS_MS)) return forget(uid);
    put(uid, "value" in found ? "asking" : "silent");
    await new Promise(resolve => setTimeout(resolve, AGAIN_MS));
    if (rounds.get(uid) !== round) return;
  }
}

function read(uid: string): Promise<Reading> {
  return ask("GET", "/servos/{uid}/parameters/torque_mode", { path: { uid } });
}

function put(uid: string, state: ReleaseState | null): void {
  const next = new Map(released.peek());
  if (state === null) next.delete(uid);
  else next.set(uid, state);
  released.value = next;
}
