/** Owns which servos are ticked on the Servos page: kept while the page lives, never one that is gone. */
import { computed, signal } from "@preact/signals";
import { uids } from "./fleet";

const ticked = signal<ReadonlySet<string>>(new Set());

/** Unique ids of the ticked servos, in the order of the list. */
export const selected = computed(() => uids.value.filter(uid => ticked.value.has(uid)));

export function isSelected(uid: string): boolean {
  return ticked.value.has(uid);
}

export function select(wanted: Iterable<string>, on: boolean): void {
  const next = new Set(ticked.peek());
  for (const uid of wanted) {
    if (on) next.add(uid);
    else next.delete(uid);
  }
  ticked.value = next;
}

export function selectNone(): void {
  ticked.value = new Set();
}
