/** The keyboard: Stop first, on every page, then the page's own keys. */

import { signal } from "@preact/signals";
import { uids } from "./fleet";
import { motionOn, moving } from "./moving";
import { go, lastUid, OF_A_SERVO, type Page, pathOf } from "./route";

type Act = (event: KeyboardEvent) => void;

const acts = new Map<string, Act[]>();

/**
 * Call `act` when a key is pressed outside a text box. The latest registration wins, so a dialog's key hides the
 * page's.
 */
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

/** True if typed text goes into a text box. */
export function inTextBox(target: EventTarget | null): boolean {
  if (target === null || !("tagName" in target)) return false;
  const element = target as HTMLElement;
  if (element.tagName === "TEXTAREA" || element.isContentEditable) return true;
  return element.tagName === "INPUT" && TYPING.has((element as HTMLInputElement).type);
}

/** True if Space acts on the element: a button, check box or list. */
export function takesSpace(target: EventTarget | null): boolean {
  if (inTextBox(target)) return true;
  if (target === null || !("closest" in target)) return false;
  return (
    (target as HTMLElement).closest("button, select, summary, input, [role=button], [role=switch]") !== null
  );
}

export type StopKey = "Esc" | "Space";

/** A second Esc within this time stops, whatever the first one closed. */
const TWICE_MS = 1000;
let escapeAt = Number.NEGATIVE_INFINITY;
let disarm: ReturnType<typeof setTimeout> | undefined;

/** True while the next Esc stops. */
export const escapeArmed = signal(false);

function arm(at: number): void {
  escapeAt = at;
  escapeArmed.value = true;
  clearTimeout(disarm);
  disarm = setTimeout(() => {
    escapeArmed.value = false;
  }, TWICE_MS);
}

/** When a key was pressed, ms on the page's clock: a slow page handles it later, a frame has a clock of its own. */
function pressedAt(event: KeyboardEvent): number {
  return event.timeStamp + (event.view ?? window).performance.timeOrigin - performance.timeOrigin;
}

/** The stop key of an event, if it stops now. */
function stopKey(event: KeyboardEvent): StopKey | null {
  if (event.key === "Escape") {
    const at = pressedAt(event);
    const twice = at - escapeAt < TWICE_MS;
    arm(at);
    return twice || moving() ? "Esc" : null;
  }
  const plain = !event.ctrlKey && !event.altKey && !event.metaKey;
  return event.key === " " && plain && motionOn() && !takesSpace(event.target) ? "Space" : null;
}

/** True if a key belongs to an input method. Safari marks the last one by its code only. */
function composes(event: KeyboardEvent): boolean {
  return event.isComposing || event.keyCode === 229;
}

const GO_MS = 1200;

/** Listen on a window: the page's own, and that of the 3D view, whose keys do not bubble to the page. */
export function listen(target: Window, stop: (key: StopKey) => void): () => void {
  let gAt = Number.NEGATIVE_INFINITY;
  const down = (event: KeyboardEvent) => {
    // Keys of an input method reach nothing on the page: neither Stop nor boxes nor dialogs.
    if (composes(event)) return event.stopPropagation();
    if (event.key === "Escape" && event.repeat) {
      event.preventDefault();
      return event.stopPropagation();
    }
    const key = stopKey(event);
    if (key) {
      if (!event.repeat) stop(key);
      event.preventDefault();
      if (key === "Esc") newest("Escape", event);
      return;
    }
    if (event.key === "Escape") return; // Next: the focused element, then the newest dialog: see `rest`.
    const held = event.ctrlKey || event.metaKey;
    if (held && !event.shiftKey && event.key.toLowerCase() === "s") {
      event.preventDefault();
      if (!covered() && !event.repeat) newest("Ctrl+S", event);
      return;
    }
    if (held && event.key === "Enter") {
      if (!covered() && !event.repeat && newest("Ctrl+Enter", event)) event.preventDefault();
      return;
    }
    if (inTextBox(event.target)) return;
    if (held && event.key.toLowerCase() === "z" && newest("Ctrl+Z", event)) event.preventDefault();
    if (held || event.altKey) return;
    if (pressedAt(event) - gAt < GO_MS && follow(event.key)) {
      gAt = Number.NEGATIVE_INFINITY;
      event.preventDefault();
      return;
    }
    const turns = TURNS.has(event.key) && !covered() && (event.key.length === 1 || free(event.target));
    if (turns && newest(event.key, event)) event.preventDefault();
    const letter = event.key.toLowerCase();
    const once = ONCE.has(letter) && !event.repeat && !covered();
    if (once && newest(letter, event)) event.preventDefault();
    gAt = event.key === "g" ? pressedAt(event) : Number.NEGATIVE_INFINITY;
    if ((event.key === "/" || event.key === "?") && newest(event.key, event)) event.preventDefault();
  };
  // An Esc that neither stopped nor was handled closes the newest dialog.
  const rest = (event: KeyboardEvent) => {
    if (event.key === "Escape" && !event.defaultPrevented && newest("Escape", event)) event.preventDefault();
  };
  target.addEventListener("keydown", down, true);
  target.addEventListener("keydown", rest);
  return () => {
    target.removeEventListener("keydown", down, true);
    target.removeEventListener("keydown", rest);
  };
}

/** A held key is one press: wiggle, selection. */
const ONCE: ReadonlySet<string> = new Set(["w", "x"]);

/** To another servo. Arrows only where they have no other meaning, and never where they could jog a horn. */
const TURNS: ReadonlySet<string> = new Set(["j", "k", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"]);

/** True if arrows have no other meaning here; other uses are marked with `data-turns`. */
function free(target: EventTarget | null): boolean {
  const through = target instanceof HTMLElement && "turns" in target.dataset;
  return (through || target === document.body || target === document.querySelector("main")) && !motionOn();
}

/** A dialog is open: actions on the page's servo are disabled. */
function covered(): boolean {
  return document.querySelector('[aria-modal="true"]') !== null;
}

function newest(key: string, event: KeyboardEvent): boolean {
  const act = acts.get(key)?.at(-1);
  act?.(event);
  return act !== undefined;
}

const PAGES: Readonly<Record<string, Page>> = {
  s: "servos",
  c: "commission",
  v: "overview",
  p: "parameters",
  m: "motion",
  t: "tune",
  f: "faults",
  e: "matrix",
  b: "bus",
  d: "recorder",
  r: "records",
  o: "scope",
  a: "api",
};

function follow(key: string): boolean {
  const page = PAGES[key];
  if (page === undefined) return false;
  const uid = lastUid.peek() ?? uids.peek()[0] ?? null;
  go(pathOf(page, page !== "faults" && OF_A_SERVO.some(one => one === page) ? uid : null));
  // Tab and screen readers continue from here on the new page.
  document.querySelector("main")?.focus();
  return true;
}
