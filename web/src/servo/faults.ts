/** Faults of servos: the last list of each, its order, and acknowledging. */

import { computed, signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import type { Fault } from "../api/types";
import { batched } from "../bench/batched";
import { namedFault } from "../bench/catalog";
import { problemText } from "../bench/facts";
import { holder } from "../bench/holder";
import { asProblem } from "../bench/parameters";

export interface KnownFault extends Fault {
  uid: string;
}

const stored = signal<ReadonlyMap<string, readonly Fault[]>>(new Map());

/** Error of reading or acknowledging the faults, by servo. */
const troubles = signal<ReadonlyMap<string, string>>(new Map());

/** The first error among these servos, in words; null if there is none. */
export function troubleOf(uids: readonly string[]): string | null {
  return uids.map(uid => troubles.value.get(uid)).find(one => one !== undefined) ?? null;
}

function setTrouble(uid: string, why: string | null): void {
  const next = new Map(troubles.peek());
  if (why === null) next.delete(uid);
  else next.set(uid, why);
  troubles.value = next;
}

/** Number of servos read at least once. */
export const readServos = computed(() => stored.value.size);

/** Read the faults of these servos in one request. On an error, a servo keeps its last list. */
async function loadFaults(uids: readonly string[]): Promise<void> {
  try {
    const response = await callApi("GET", "/faults", { query: { uids: uids.join(",") } });
    const next = new Map(stored.peek());
    for (const [uid, { faults, problem }] of Object.entries(response.servos)) {
      if (!problem) next.set(uid, faults.map(namedFault));
      setTrouble(uid, problem ? problemText(asProblem(problem)) : null);
    }
    stored.value = next;
  } catch (error) {
    for (const uid of uids) setTrouble(uid, problemText(problemOf(error)));
  }
}

/** Read the faults of a servo, batched with other servos. */
export const readFaults = batched(loadFaults);

/** Acknowledge a fault; without a key all faults of the servo. */
export async function acknowledge(uid: string, key?: string): Promise<void> {
  const query = { by: holder() };
  try {
    await (key === undefined
      ? callApi("POST", "/servos/{uid}/faults/acknowledge", { path: { uid }, query })
      : callApi("POST", "/servos/{uid}/faults/{key}/acknowledge", { path: { uid, key }, query }));
  } catch (error) {
    setTrouble(uid, problemText(problemOf(error)));
    return;
  }
  readFaults(uid);
}

/** True if the fault still needs an acknowledgement. Notifications do not: they come and go in normal use. */
export function unseen(one: Fault): boolean {
  return one.acknowledged_at == null && one.level !== "notification";
}

/** True for a current fault: set, or set when the servo last responded. */
export function present(one: Fault): boolean {
  return one.active || one.stale;
}

const RANK = { failure: 0, warning: 1, notification: 2 } as const;

/** Worst first; then unacknowledged, then confirmed, then newest. */
export function compare(a: KnownFault, b: KnownFault): number {
  return (
    RANK[a.level] - RANK[b.level] ||
    Number(unseen(b)) - Number(unseen(a)) ||
    Number(b.active) - Number(a.active) ||
    b.last_seen - a.last_seen ||
    a.uid.localeCompare(b.uid) ||
    a.bit - b.bit
  );
}

/** Faults of these servos: current ones, then past ones. */
export function faultsOf(uids: readonly string[]): { now: KnownFault[]; past: KnownFault[] } {
  const lines = uids.flatMap(uid => (stored.value.get(uid) ?? []).map(one => ({ ...one, uid })));
  return {
    now: lines.filter(present).sort(compare),
    past: lines.filter(one => !present(one)).sort(compare),
  };
}
