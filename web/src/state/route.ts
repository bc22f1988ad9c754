/** Owns the address bar: which page is shown, of which servo, at which parameter. */
import { computed, signal } from "@preact/signals";

export type Page = "servos" | "commission" | "parameters" | "motion" | "tune" | "faults" | "bus" | "records";

export interface Route {
  page: Page;
  uid: string | null;
  /** What stands behind the #: a parameter's key, or a part of the page. */
  hash: string;
}

const ALONE = /^\/(commission|tune|faults|bus|records)\/?$/;
const SERVO = /^\/servos\/([0-9a-f]{32})\/(parameters|motion|tune|faults)\/?$/;

export function parse(path: string, hash: string): Route {
  const behind = decodeURIComponent(hash.replace(/^#/, ""));
  const alone = ALONE.exec(path);
  if (alone) return { page: alone[1] as Page, uid: null, hash: behind };
  const found = SERVO.exec(path);
  if (!found?.[1]) return { page: "servos", uid: null, hash: "" };
  return { page: found[2] as Page, uid: found[1], hash: behind };
}

export function pathOf(page: Page, uid: string | null, hash = ""): string {
  const behind = hash === "" ? "" : `#${hash}`;
  if (page === "bus" || page === "commission" || page === "records") return `/${page}${behind}`;
  if ((page === "faults" || page === "tune") && uid === null) return `/${page}${behind}`;
  if (page === "servos" || uid === null) return "/servos";
  return `/servos/${uid}/${page}${behind}`;
}

const here = () => parse(location.pathname, location.hash);

export const route = signal<Route>(here());

/** The servo last looked at: where the rail's Parameters and Motion lead. */
export const lastUid = signal<string | null>(route.peek().uid);

export const page = computed(() => route.value.page);

/** Asked before another page is shown; motion ends there. */
const leaving = new Set<() => void>();

export function onLeave(act: () => void): () => void {
  leaving.add(act);
  return () => leaving.delete(act);
}

export function go(path: string, replace = false): void {
  if (replace) history.replaceState(null, "", path);
  else history.pushState(null, "", path);
  follow();
}

function follow(): void {
  const next = here();
  const before = route.peek();
  if (next.page !== before.page || next.uid !== before.uid) for (const act of leaving) act();
  if (next.uid) lastUid.value = next.uid;
  route.value = next;
}

export function startRoute(): void {
  if (location.pathname === "/") go("/servos", true);
  addEventListener("popstate", follow);
}
