/** Who this page is to others, and which lease is its own. */
import { signal } from "@preact/signals";
import type { LeaseView } from "../api/types";
import { text } from "../text";
import { readable } from "../text/holder-name";
import { signedBy } from "./session";
import { readTab, writeTab } from "./tab-store";

const NAME = "hornbill.tab";
const LOWEST = 1000;
const HIGHEST = 9999;

/**
 * The number of this tab, the same over a reload. It is in the tab's store only while the page is not there: a copy of
 * the tab begins with a copy of the store, and is somebody else.
 */
const number = numberOf(readTab(NAME));
writeTab(NAME, null);
addEventListener("pagehide", () => writeTab(NAME, number));
addEventListener("pageshow", event => {
  if (event.persisted) writeTab(NAME, null);
});

function numberOf(kept: unknown): number {
  const known = typeof kept === "number" && kept >= LOWEST && kept <= HIGHEST;
  return known ? kept : LOWEST + Math.floor(Math.random() * (HIGHEST - LOWEST + 1));
}

/** A name for this tab by which others can tell who moves what: stored by the server, so in no language but its own. */
export function holder(): string {
  return signedBy(`Page ${number}`);
}

/** A stored name as people read it here. */
export function who(name: string): string {
  return readable(name, text.motion.holder);
}

const KEPT = 8;

/** Leases that this page was given, the newest first: one that was given back may be shown a moment longer. */
const own = signal<readonly string[]>([]);

export function haveLease(id: string): void {
  if (!own.peek().includes(id)) own.value = [id, ...own.peek()].slice(0, KEPT);
}

/** Whether that lease is the one of this page. Names do not tell: two may have the same. */
export function isOurs(view: Pick<LeaseView, "shown_id">): boolean {
  return own.value.some(id => id.startsWith(view.shown_id));
}
