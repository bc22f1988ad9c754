/** Wiggles: one horn at a time moves a little to identify the servo; several in turn. */

import { computed, signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import { text } from "../text";
import { monotonic } from "./clock";
import { endText, problemText } from "./facts";
import { angleOf, peekServo } from "./fleet";
import { jobs, setJob, settled } from "./jobs";
import { leaseHeader } from "./motion";
import { stopSeen } from "./stop-sight";

export type Wiggled =
  | { uid: string; phase: "requesting" }
  | { uid: string; phase: "moving"; around: number | null }
  | { uid: string; phase: "moved"; low: number; high: number }
  | { uid: string; phase: "refused"; why: string };

/** The last requested wiggle. */
export const wiggled = signal<Wiggled | null>(null);

/** A wiggle is running; others wait for it. */
export const wiggling = computed(
  () => wiggled.value?.phase === "requesting" || wiggled.value?.phase === "moving",
);

/** Refusals that apply to all other servos, too. */
const OF_ALL = new Set(["stopped", "lease_held", "bus_disconnected", "no_link", "unauthorized"]);

/** Wiggle one horn. The server takes motion control for it, unless this page has it. */
export async function wiggle(uid: string): Promise<void> {
  if (!wiggling.peek()) await one(uid);
}

/** Returns whether the next one may be tried. */
async function one(uid: string): Promise<boolean> {
  if (!stopSeen()) {
    wiggled.value = { uid, phase: "refused", why: text.motion.stopHidden };
    return false;
  }
  wiggled.value = { uid, phase: "requesting" };
  try {
    const job = await callApi("POST", "/servos/{uid}/identify", { path: { uid }, headers: leaseHeader() });
    if (!jobs.peek().has(job.id)) setJob(job);
    const known = peekServo(uid);
    wiggled.value = { uid, phase: "moving", around: known ? angleOf(known, monotonic()).value : null };
    const end = await settled(job.id);
    const result = end.result as { low_deg?: number; high_deg?: number } | null;
    wiggled.value =
      end.state === "succeeded"
        ? { uid, phase: "moved", low: result?.low_deg ?? 0, high: result?.high_deg ?? 0 }
        : { uid, phase: "refused", why: endText(end) };
    return end.error === null || !OF_ALL.has(end.error.code);
  } catch (error) {
    const problem = problemOf(error);
    wiggled.value = { uid, phase: "refused", why: problemText(problem) };
    return !OF_ALL.has(problem.code);
  }
}

/** Several in turn: number done, remaining, and failed. */
export interface Round {
  uids: readonly string[];
  /** Index of the current one; past the end when finished. */
  at: number;
  refused: ReadonlyMap<string, string>;
}

export const round = signal<Round | null>(null);

/** Wiggle each in this order. Ends early at a refusal that applies to all. */
export async function wiggleInTurn(uids: readonly string[]): Promise<void> {
  if (wiggling.peek() || uids.length === 0) return;
  round.value = { uids, at: 0, refused: new Map() };
  for (let at = 0; at < (round.peek()?.uids.length ?? 0); at++) {
    const uid = uids[at] ?? "";
    const goOn = await one(uid);
    const last = wiggled.peek();
    const present = round.peek();
    if (present === null) return;
    const refused = new Map(present.refused);
    if (last?.phase === "refused") refused.set(uid, last.why);
    round.value = { uids: goOn ? present.uids : present.uids.slice(0, at + 1), at: at + 1, refused };
  }
}

/** Let the current one end, and skip the rest. */
export function endRound(): void {
  const present = round.peek();
  if (present) round.value = { ...present, uids: present.uids.slice(0, present.at + 1) };
}
