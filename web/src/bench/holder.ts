/** Name of this page for other clients, and its own leases. */
import { signal } from "@preact/signals";
import type { LeaseView } from "../api/types";
import { text } from "../text";
import { pageName, readable } from "../text/holder-name";
import { signedBy } from "./session";
import { readTab, writeTab } from "./tab-store";

const NAME = "hornbill.tab";
const LOWEST = 1000;
const HIGHEST = 9999;

/**
 * Number of this tab, kept over a reload. It is in the session storage only between unload and load: a duplicated tab
 * starts with a copy of the storage and must get a number of its own.
 */
const number = numberOf(readTab(NAME));
writeTab(NAME, null);
addEventListener("pagehide", () => writeTab(NAME, number));
addEventListener("pageshow", event => {
  if (event.persisted) writeTab(NAME, null);
});

function numberOf(stored: unknown): number {
  const known = typeof stored === "number" && stored >= LOWEST && stored <= HIGHEST;
  return known ? stored : LOWEST + Math.floor(Math.random() * (HIGHEST - LOWEST + 1));
}

/** Name of this tab as the server stores it. */
export function holder(): string {
  return signedBy(pageName(number));
}

/** A stored name, or a text with stored names, in the language of the page. */
export function who(stored: string): string {
  return readable(stored, text.motion.holder);
}

const OWN_MAX = 8;

/** IDs of the leases of this page, the newest first. A released lease may still be shown for a moment. */
const own = signal<readonly string[]>([]);

export function haveLease(id: string): void {
  if (!own.peek().includes(id)) own.value = [id, ...own.peek()].slice(0, OWN_MAX);
}

/** True if the lease belongs to this page. Names do not identify holders: two may have the same. */
export function isOurs(view: Pick<LeaseView, "shown_id">): boolean {
  return own.value.some(id => id.startsWith(view.shown_id));
}
