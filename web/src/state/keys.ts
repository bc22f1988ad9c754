/** Owns the keyboard: Stop first and everywhere, then the page's own keys. */

import { uids } from "./fleet";
import { go, lastUid, type Page, pathOf } from "./route";

type Act = (event: KeyboardEvent) => void;

const acts = new Map<string, Act[]>();

/** Calls `act` when a key is pressed outside a text box. The newest wins, so a dialog's key hides the page's. */
export function onKey(key: string, act: Act): () => void {
  acts.set(key, [...(acts.get(key) ?? []), act]);
  return () => {
    acts.set(
      key,
      (acts.get(key) ?? []).filter(one => one !== act),
    );
  };
}

const TYPING = new Set(["text", "search", "number", "email", "url", "tel", "password", ""]);

/** Whether what is typed now goes into a text box. */
export function inTextBox(target: EventTarget | null): boolean {
  if (target === null || !("tagName" in target)) return false;
  const element = target as HTMLElement;
  if (element.tagName === "TEXTAREA" || element.isContentEditable) return true;
  return element.tagName === "INPUT" && TYPING.has((element as HTMLInputElement).type);
}

/** Whether Space means something to the element itself: a button, a box to tick, a list to open. */
export function takesSpace(target: EventTarget | null): boolean {
  if (inTextBox(target)) return true;
  if (target === null || !("closest" in target)) return false;
  return (
    (target as HTMLElement).closest("button, select, summary, input, [role=button], [role=switch]") !== null
  );
}

export type StopKey = "Esc" | "Space";

/** Which stop key an event is, if it is one here. */
export function stopKey(event: KeyboardEvent): StopKey | null {
  if (event.key === "Escape") return "Esc";
  const plain = !event.ctrlKey && !event.altKey && !event.metaKey;
  if (event.key === " " && plain && !takesSpace(event.target)) return "Space";
  return null;
}

const GO_MS = 1200;

/** Listens on a window: the page's own, and the 3D view's, for keys pressed there do not come up to us. */
export function listen(target: Window, stop: (key: StopKey) => void): () => void {
  let gAt = Number.NEGATIVE_INFINITY;
  const down = (event: KeyboardEvent) => {
    const key = stopKey(event);
    if (key) {
      if (!event.repeat) stop(key);
      event.preventDefault();
      if (key === "Esc") newest("Escape", event);
      return;
    }
    const held = event.ctrlKey || event.metaKey;
    if (held && !event.shiftKey && event.key.toLowerCase() === "s") {
      event.preventDefault();
      newest("Ctrl+S", event);
      return;
    }
    if (inTextBox(event.target)) return;
    if (held && event.key.toLowerCase() === "z" && newest("Ctrl+Z", event)) event.preventDefault();
    if (held || event.altKey) return;
    if (performance.now() - gAt < GO_MS && follow(event.key)) {
      gAt = Number.NEGATIVE_INFINITY;
      event.preventDefault();
      return;
    }
    gAt = event.key === "g" ? performance.now() : Number.NEGATIVE_INFINITY;
    if ((event.key === "/" || event.key === "?") && newest(event.key, event)) event.preventDefault();
  };
  target.addEventListener("keydown", down, true);
  return () => target.removeEventListener("keydown", down, true);
}

function newest(key: string, event: KeyboardEvent): boolean {
  const act = acts.get(key)?.at(-1);
  act?.(event);
  return act !== undefined;
}

const PAGES: Readonly<Record<string, Page>> = {
  s: "servos",
  c: "commission",
  p: "parameters",
  m: "motion",
  t: "tune",
  f: "faults",
  b: "bus",
  r: "records",
  a: "api",
};

/** Pages of one servo; the others show all of them. */
const OF_A_SERVO: ReadonlySet<Page> = new Set(["parameters", "motion", "tune"]);

function follow(key: string): boolean {
  const page = PAGES[key];
  if (page === undefined) return false;
  const uid = lastUid.peek() ?? uids.peek()[0] ?? null;
  go(pathOf(page, OF_A_SERVO.has(page) ? uid : null));
  // From here Tab goes through the new page, and a screen reader begins to read it.
  document.querySelector("main")?.focus();
  return true;
}
