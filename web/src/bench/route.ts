/** The address bar: page, servo, parameter, and settings of a page stored in it. */
import { computed, effect, type Signal, signal } from "@preact/signals";
import { decoded, ROOT } from "../api/root";

export type Page =
  | "servos"
  | "matrix"
  | "commission"
  | "overview"
  | "parameters"
  | "motion"
  | "tune"
  | "faults"
  | "bus"
  | "recorder"
  | "records"
  | "scope"
  | "site"
  | "api"
  /** Unknown address. */
  | "missing";

export interface Route {
  page: Page;
  uid: string | null;
  /** The hash: key of a parameter, or part of the page. */
  hash: string;
}

const ALONE = /^\/(servos|commission|tune|faults|bus|recorder|records|scope|site)\/?$/;
/** Not /api, which belongs to the server. */
const API_PAGE = /^\/api-page\/?$/;
const MATRIX = /^\/servos\/matrix\/?$/;
const SERVO = /^\/servos\/([0-9a-f]{32})(?:\/(parameters|motion|tune|faults))?\/?$/;

export function parse(path: string, hash: string): Route {
  const behind = decoded(hash.replace(/^#/, ""));
  if (path.length < 2) return { page: "servos", uid: null, hash: behind };
  const alone = ALONE.exec(path);
  if (alone) return { page: alone[1] as Page, uid: null, hash: behind };
  if (API_PAGE.test(path)) return { page: "api", uid: null, hash: behind };
  if (MATRIX.test(path)) return { page: "matrix", uid: null, hash: behind };
  const found = SERVO.exec(path);
  if (!found?.[1]) return { page: "missing", uid: null, hash: "" };
  return { page: (found[2] ?? "overview") as Page, uid: found[1], hash: behind };
}

/** Settings of a page in its address, by name; empty ones are omitted. */
export type Query = Readonly<Record<string, string>>;

/** The address of a page, below the base path. */
export function pathOf(page: Page, uid: string | null, hash = "", query: Query = {}): string {
  return ROOT + below(page, uid) + written(withQuery("", query)) + (hash === "" ? "" : `#${hash}`);
}

function below(page: Page, uid: string | null): string {
  if (page === "api") return "/api-page";
  if (ALONE.test(`/${page}`) && page !== "tune" && page !== "faults") return `/${page}`;
  if ((page === "faults" || page === "tune") && uid === null) return `/${page}`;
  if (page === "matrix") return "/servos/matrix";
  if (page === "servos" || page === "missing" || uid === null) return "/servos";
  return page === "overview" ? `/servos/${uid}` : `/servos/${uid}/${page}`;
}

function withQuery(before: string, changes: Query): string {
  const next = new URLSearchParams(before);
  for (const [name, value] of Object.entries(changes)) {
    if (value === "") next.delete(name);
    else next.set(name, value);
  }
  return next.toString();
}

/** Lists of servos in addresses stay readable. */
function written(query: string): string {
  return query === "" ? "" : `?${query.replaceAll("%2C", ",")}`;
}

const here = () => parse(location.pathname.slice(ROOT.length), location.hash);

export const route = signal<Route>(here());

/** The query without "?". */
const query = signal(location.search.slice(1));

/** The servo last viewed: target of Motion in the rail and of the keys of the tabs. */
export const lastUid = signal<string | null>(route.peek().uid);

export const page = computed(() => route.value.page);

/** Called before another page is shown; motion ends there. */
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
  clearTimeout(refused);
  const next = here();
  const before = route.peek();
  const moved = next.page !== before.page || next.uid !== before.uid;
  if (moved) for (const act of leaving) act();
  if (next.uid) lastUid.value = next.uid;
  query.value = location.search.slice(1);
  if (moved || next.hash !== before.hash) route.value = next;
}

let refused: ReturnType<typeof setTimeout> | undefined;
const AGAIN_MS = 1000;

/** Change settings of this page in its address, without a history entry; `hash` stays unless given. */
export function changeChoices(choices: Query, hash?: string): void {
  query.value = withQuery(query.peek(), choices);
  if (hash !== undefined && hash !== route.peek().hash) route.value = { ...route.peek(), hash };
  write(hash === undefined ? location.hash : hash && `#${hash}`);
}

function write(behind: string): void {
  clearTimeout(refused);
  try {
    history.replaceState(null, "", location.pathname + written(query.peek()) + behind);
  } catch {
    // Browsers limit the rate of changes: the last one follows later.
    refused = setTimeout(() => write(behind), AGAIN_MS);
  }
}

/** Pages of one servo: tabs below one head. Faults without a servo shows all of them. */
export const OF_A_SERVO = ["overview", "parameters", "motion", "tune", "faults"] as const;
export type ServoTab = (typeof OF_A_SERVO)[number];

/** True if this page is a tab of a servo. */
export function isTab(page: Page): page is ServoTab {
  return OF_A_SERVO.some(one => one === page);
}

/** The address of the same page and settings for another servo. */
export function sameFor(uid: string): string {
  const { page, hash } = route.peek();
  return pathOf(page, uid, hash, Object.fromEntries(new URLSearchParams(query.peek())));
}

/** A setting stored in the address of a page, restored by Back and reload. */
export interface AddressChoice<T> {
  value: T;
  peek: () => T;
}

/** A setting of this name; `read` accepts any text, and `write` returns "" for the default. */
export function inAddress<T>(
  name: string,
  read: (text: string) => T,
  write: (value: T) => string,
): AddressChoice<T> {
  const text = computed(() => new URLSearchParams(query.value).get(name) ?? "");
  return {
    get value() {
      return read(text.value);
    },
    set value(next: T) {
      const word = write(next);
      if (word !== text.peek()) changeChoices({ [name]: word });
    },
    peek: () => read(text.peek()),
  };
}

/** Typed text, for example in a search box. */
export function wordInAddress(name: string): AddressChoice<string> {
  return inAddress(
    name,
    text => text,
    value => value,
  );
}

/** One of these; the first is the default, also for invalid text. */
export function oneInAddress<T extends string>(name: string, all: readonly [T, ...T[]]): AddressChoice<T> {
  return inAddress(
    name,
    text => all.find(one => one === text) ?? all[0],
    value => (value === all[0] ? "" : value),
  );
}

/** Bind a signal to a setting in the address; initially the address wins, if it has one. */
export function keepInAddress(name: string, stored: Signal<string>): () => void {
  const word = wordInAddress(name);
  if (word.peek() !== "") stored.value = word.peek();
  return effect(() => {
    word.value = stored.value;
  });
}

export function startRoute(): void {
  if (location.pathname.slice(ROOT.length).length < 2) go(pathOf("servos", null), true);
  addEventListener("popstate", follow);
}
