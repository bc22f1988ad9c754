/** Selected servos of the Servos page: stored for the tab, without servos that are gone. */
import { computed, effect, signal } from "@preact/signals";
import { uids } from "../bench/fleet";
import { readTab, writeTab } from "../bench/tab-store";

const NAME = "hornbill.selected";

const ticked = signal<ReadonlySet<string>>(known(readTab(NAME)));
effect(() => writeTab(NAME, [...ticked.value]));

function known(found: unknown): ReadonlySet<string> {
  return new Set(Array.isArray(found) ? found.map(String) : []);
}

/** UIDs of the selected servos, in the order of the list. */
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
