/** Owns the address bar: which page is shown, of which servo, at which parameter. */
import { computed, signal } from "@preact/signals";
import { ROOT } from "../api/root";

export type Page =
  | "servos"
  | "matrix"
  | "commission"
  | "parameters"
  | "motion"
  | "tune"
  | "faults"
  | "bus"
  | "records"
  | "api";

export interface Route {
  page: Page;
  uid: string | null;
  /** What stands behind the #: a parameter's key, or a part of the page. */
  hash: string;
}

const ALONE = /^\/(commission|tune|faults|bus|records)\/?$/;
/** Not /api: what begins with that is the server's. */
const API_PAGE = /^\/api-page\/?$/;
const MATRIX = /^\/servos\/matrix\/?$/;
const SERVO = /^\/servos\/([0-9a-f]{32})\/(parameters|motion|tune|faults)\/?$/;

export function parse(path: string, hash: string): Route {
  const behind = decodeURIComponent(hash.replace(/^#/, ""));
  const alone = ALONE.exec(path);
  if (alone) return { page: alone[1] as Page, uid: null, hash: behind };
  if (API_PAGE.test(path)) return { page: "api", uid: null, hash: behind };
  if (MATRIX.test(path)) return { page: "matrix", uid: null, hash: behind };
  const found = SERVO.exec(path);
  if (!found?.[1]) return { page: "servos", uid: null, hash: "" };
  return { page: found[2] as Page, uid: found[1], hash: behind };
}

/** The address of a page, below the path this one lives at. */
export function pathOf(page: Page, uid: string | null, hash = ""): string {
  return ROOT + below(page, uid, hash);
}

function below(page: Page, uid: string | null, hash: string): string {
  const behind = hash === "" ? "" : `#${hash}`;
  if (page === "api") return `/api-page${behind}`;
  if (page === "bus" || page === "commission" || page === "records") return `/${page}${behind}`;
  if ((page === "faults" || page === "tune") && uid === null) return `/${page}${behind}`;
  if (page === "matrix") return `/servos/matrix${behind}`;
  if (page === "servos" || uid === null) return "/servos";
  return `/servos/${uid}/${page}${behind}`;
}

const here = () => parse(location.pathname.slice(ROOT.length), location.hash);

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
  if (location.pathname.slice(ROOT.length).length < 2) go(pathOf("servos", null), true);
  addEventListener("popstate", follow);
}
