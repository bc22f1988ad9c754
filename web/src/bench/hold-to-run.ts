/** Run while a button is held: speed, torque or an angle that walks on, from press to release, and every way a release shows itself. */
import { effect, signal } from "@preact/signals";
import { text } from "../text";
import { link, live, onRefusal } from "./link";
import {
  dragTo,
  endMotion,
  motion,
  motionRefusal,
  pace,
  presentAngle,
  profileOf,
  question,
  setpoint,
  warnings,
} from "./motion";

export type RunKind = "speed" | "torque";

export interface RunHeld {
  kind: RunKind;
  /** rpm or %, + clockwise. */
  value: number;
}

/** The speed or torque that runs now, because something is held; null otherwise. */
export const held = signal<RunHeld | null>(null);

/** Which way the angle walks now, because something is held: 1 clockwise, -1 the other way, 0 not at all. */
export const walking = signal<-1 | 0 | 1>(0);

/** The server brakes by itself when it hears nothing for so long. */
export const FOR_S = 0.5;
const RENEW_MS = 120;
/** A walk that may go as fast as the servo can goes as fast as a gentle one, °/s. */
const WALK_DEG_S = 60;
const WALK_MS = 1000 / 30;

/** What a held button does. Each answers whether it could be said. */
interface Doing {
  renew: () => boolean;
  end: () => boolean;
}

let doing: Doing | null = null;
let timer: ReturnType<typeof setInterval> | undefined;
let unlisten: (() => void) | null = null;

/** Begins to run. `still` says whether the button is held as far as can be seen; asked eight times a second. */
export function press(kind: RunKind, value: number, still: () => boolean): void {
  if (value === 0 || !mayBegin()) return;
  setpoint.value = null;
  if (!say(kind, value, false)) {
    endMotion(text.motion.endedByLink);
    return;
  }
  held.value = { kind, value };
  begin({ renew: () => say(kind, value, true), end: () => say(kind, 0, false) }, RENEW_MS, still);
}

/**
 * Begins to walk the angle towards `limit` at the chosen speed. The command is never further ahead than the horn needs
 * to come to rest, so a page that falls silent, like a release, leaves nothing to go on with.
 */
export function walk(limit: number, still: () => boolean): void {
  const present = motion.peek();
  const from = present.phase === "on" ? (setpoint.peek() ?? presentAngle(present.uid)) : null;
  if (from === null || limit === from || !mayBegin()) return;
  const way = limit > from ? 1 : -1;
  const speed = pace.peek() ?? WALK_DEG_S;
  const profile = profileOf(pace.peek());
  const began = performance.now();
  const renew = () => {
    const s = (performance.now() - began) / 1000;
    // Where the horn is by now and what it needs to brake, in one: first while it gathers speed, then at its speed.
    const gone = profile ? Math.min(profile.accel_deg_s2 * s * s, speed * s) : speed * s;
    const wanted = Math.round((from + way * gone) * 10) / 10;
    dragTo(way > 0 ? Math.min(limit, wanted) : Math.max(limit, wanted));
    return true;
  };
  walking.value = way;
  begin({ renew, end: () => true }, WALK_MS, still);
}

function mayBegin(): boolean {
  const present = motion.peek();
  if (present.phase !== "on" || present.torque !== "on" || question.peek() !== null) return false;
  brake();
  motionRefusal.value = null;
  warnings.value = [];
  return true;
}

function begin(next: Doing, period_ms: number, still: () => boolean): void {
  doing = next;
  unlisten = listen();
  timer = setInterval(() => {
    if (motion.peek().phase !== "on" || !still() || !document.hasFocus() || document.hidden) brake();
    else if (!next.renew()) brake();
  }, period_ms);
}

/** Brakes, whatever was the reason. A release that cannot be said ends motion, which takes torque by another way. */
export function brake(): void {
  const last = doing;
  if (last === null) return;
  clearInterval(timer);
  unlisten?.();
  unlisten = null;
  doing = null;
  held.value = null;
  walking.value = 0;
  if (motion.peek().phase !== "on") return; // torque off was sent, or stop was
  if (!last.end()) endMotion(text.motion.endedByLink);
}

function say(kind: RunKind, value: number, renew: boolean): boolean {
  const present = motion.peek();
  if (present.phase !== "on") return false;
  const hold = { for_s: FOR_S, renew };
  const command = { uid: present.uid, type: kind, value, profile: null, hold };
  return live.send({ type: "command", lease: present.lease, commands: [command] });
}

/** Everything by which a finger or a key that left can be noticed, beside the button's own events. */
function listen(): () => void {
  const ends: (() => void)[] = [];
  const on = (target: EventTarget, names: string, act: (event: Event) => void) => {
    for (const name of names.split(" ")) {
      target.addEventListener(name, act, true);
      ends.push(() => target.removeEventListener(name, act, true));
    }
  };
  on(window, "blur pagehide pointerup pointercancel mouseup touchend touchcancel dragstart", brake);
  on(document, "visibilitychange freeze", brake);
  // Off the button; and a mouse that moves with no button pressed was released where nobody told us.
  on(window, "pointermove", event => {
    const pointer = event as PointerEvent;
    if (heldBy === null || pointer.pointerId !== heldBy.pointerId) return;
    if ((pointer.pointerType === "mouse" && pointer.buttons === 0) || !isOn(heldBy.button, pointer)) brake();
  });
  on(window, "keydown", event => {
    if (!(event as KeyboardEvent).repeat) brake();
  });
  on(window, "keyup", brake);
  // Motion that ends, a question, a lost link or a refusal: nobody's finger counts any more.
  let first = true;
  ends.push(
    effect(() => {
      const present = motion.value;
      const ended = present.phase !== "on" || present.torque !== "on";
      const over = ended || question.value !== null || link.value.state !== "up";
      if (!first && over) brake();
      first = false;
    }),
    onRefusal(error => {
      const present = motion.peek();
      if (present.phase === "on" && (error.uid === present.uid || error.uid === null)) brake();
    }),
  );
  return () => {
    for (const end of ends) end();
  };
}

let heldBy: { button: Element; pointerId: number } | null = null;

/** A finger rolls: so far beside the button is on it. */
const SLACK_PX = 16;

function isOn(button: Element, { clientX: x, clientY: y }: PointerEvent): boolean {
  const { left, top, right, bottom } = button.getBoundingClientRect();
  return x > left - SLACK_PX && x < right + SLACK_PX && y > top - SLACK_PX && y < bottom + SLACK_PX;
}

/** Does `act` with a pointer that is down on a button, and is the button's own until it goes up. */
export function pressByPointer(event: PointerEvent, act: (still: () => boolean) => void): void {
  const button = event.currentTarget as HTMLElement;
  if (event.button !== 0 || !event.isPrimary) return;
  event.preventDefault();
  button.focus();
  const { pointerId } = event;
  button.setPointerCapture(pointerId);
  heldBy = { button, pointerId };
  act(() => button.isConnected && button.hasPointerCapture(pointerId));
}

/** Begins to run for as long as a key is down. What repeats is the same press. */
export function pressByKey(event: KeyboardEvent, kind: RunKind, value: number): void {
  event.preventDefault();
  if (event.repeat || held.peek() !== null) return;
  const where = event.currentTarget as HTMLElement;
  heldBy = null;
  press(kind, value, () => where.isConnected && where.contains(document.activeElement));
}
