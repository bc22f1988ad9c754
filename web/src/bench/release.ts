/** Torque after the end of motion of this page: off as acknowledged, or unknown. */
import { signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import type { Reading } from "../api/types";

/** "requesting": no response yet. "off": acknowledged. "silent": no response. */
export type ReleaseState = "requesting" | "off" | "silent";

export const released = signal<ReadonlyMap<string, ReleaseState>>(new Map());

const AGAIN_MS = 1000;
/** If torque is still on this long after our motion ended, another client has turned it on. */
const OTHERS_MS = 3000;

const rounds = new Map<string, symbol>();

/** Servos in this state. */
export function those(state: ReleaseState): string[] {
  return [...released.value].flatMap(([uid, one]) => (one === state ? [uid] : []));
}

/** Results are no longer of interest; servos without a response stay. */
export function forgetConfirmed(): void {
  released.value = new Map([...released.peek()].filter(([, one]) => one !== "off"));
}

/** Torque is on, so do not wait for off. */
export function forget(uid: string): void {
  rounds.delete(uid);
  put(uid, null);
}

/** Wait for the response `reported` to a torque off; without one, read torque mode until the servo responds. */
export async function followRelease(uid: string, reported: Promise<Reading> = read(uid)): Promise<void> {
  const round = Symbol(uid);
  rounds.set(uid, round);
  put(uid, "requesting");
  const began = performance.now();
  for (let response = reported; ; response = read(uid)) {
    const found = await response.catch(error => problemOf(error));
    if (rounds.get(uid) !== round) return;
    if ("value" in found && found.value !== "on") return put(uid, "off");
    const gone = "code" in found && found.code === "unknown_servo";
    if (gone || ("value" in found && performance.now() - began > OTHERS_MS)) return forget(uid);
    put(uid, "value" in found ? "requesting" : "silent");
    await new Promise(resolve => setTimeout(resolve, AGAIN_MS));
    if (rounds.get(uid) !== round) return;
  }
}

function read(uid: string): Promise<Reading> {
  return callApi("GET", "/servos/{uid}/parameters/torque_mode", { path: { uid } });
}

function put(uid: string, state: ReleaseState | null): void {
  const next = new Map(released.peek());
  if (state === null) next.delete(uid);
  else next.set(uid, state);
  released.value = next;
}
