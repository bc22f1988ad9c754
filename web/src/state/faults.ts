/** Owns what the Faults page knows: the list of every servo as last read, its order, and acknowledging. */
import { computed, signal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Fault } from "../api/types";
import { text } from "../text";
import { namedFault } from "./catalog";
import { holder } from "./motion";

export interface Line extends Fault {
  uid: string;
}

const kept = signal<ReadonlyMap<string, readonly Fault[]>>(new Map());

/** Why the faults of a servo could not be read or acknowledged. */
export const trouble = signal<string | null>(null);

/** How many servos were read at least once. */
export const readServos = computed(() => kept.value.size);

const rounds = new Map<string, number>();

/** Reads the faults of one servo; the newest question wins. */
export async function readFaults(uid: string): Promise<void> {
  const round = (rounds.get(uid) ?? 0) + 1;
  rounds.set(uid, round);
  try {
    const found = await ask<Fault[]>("GET", `/servos/${uid}/faults`);
    if (rounds.get(uid) !== round) return;
    kept.value = new Map(kept.peek()).set(uid, found.map(namedFault));
    trouble.value = null;
  } catch (error) {
    if (rounds.get(uid) === round) trouble.value = text.problem(problemOf(error));
  }
}

/** Somebody has seen this fault; without a key all of that servo. */
export async function acknowledge(uid: string, key?: string): Promise<void> {
  const by = `by=${encodeURIComponent(holder())}`;
  try {
    await ask<unknown>(
      "POST",
      key === undefined
        ? `/servos/${uid}/faults/acknowledge?${by}`
        : `/servos/${uid}/faults/${key}/acknowledge?${by}`,
    );
  } catch (error) {
    trouble.value = text.problem(problemOf(error));
    return;
  }
  await readFaults(uid);
}

/** Whether somebody should still say that they have seen it: notifications come and go in normal use. */
export function unseen(one: Fault): boolean {
  return one.acknowledged_at == null && one.level !== "notification";
}

/** Whether it stands among what is so now: set, or set when the servo said so last. */
export function present(one: Fault): boolean {
  return one.active || one.stale;
}

const RANK = { failure: 0, warning: 1, notification: 2 } as const;

/** Worst first; of the same level what nobody has seen, then what is known to be so, then the newest. */
export function compare(a: Line, b: Line): number {
  return (
    RANK[a.level] - RANK[b.level] ||
    Number(unseen(b)) - Number(unseen(a)) ||
    Number(b.active) - Number(a.active) ||
    b.last_seen - a.last_seen ||
    a.uid.localeCompare(b.uid) ||
    a.bit - b.bit
  );
}

/** The faults of these servos: those that are, then those that were. */
export function faultsOf(uids: readonly string[]): { now: Line[]; past: Line[] } {
  const lines = uids.flatMap(uid => (kept.value.get(uid) ?? []).map(one => ({ ...one, uid })));
  return {
    now: lines.filter(present).sort(compare),
    past: lines.filter(one => !present(one)).sort(compare),
  };
}
