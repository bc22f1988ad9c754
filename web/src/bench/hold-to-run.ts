/** Hold to run: speed, torque or a moving angle from press to release, and every way to detect a release. */
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

/** The speed or torque that runs while held; null otherwise. */
export const held = signal<RunHeld | null>(null);

/** Direction of the angle while held: 1 clockwise, −1 counterclockwise, 0 none. */
export const walking = signal<-1 | 0 | 1>(0);

/** The server brakes after this time without a renewal. */
export const FOR_S = 0.5;
const RENEW_MS = 120;
/** Speed of the angle if no limit is chosen, °/s. */
const WALK_DEG_S = 60;
const WALK_MS = 1000 / 30;

/** Action of a held button. Returns whether it was sent. */
interface Doing {
  renew: () => boolean;
  end: () => boolean;
}

let doing: Doing | null = null;
let timer: ReturnType<typeof setInterval> | undefined;
let unlisten: (() => void) | null = null;

/** Start. `still` returns whether the button is still held; called eight times a second. */
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
 * Start moving the angle towards `limit` at the chosen speed. The command stays only as far ahead as the horn needs to
 * stop, so that it stops on release or silence.
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
    // Distance the horn needs to brake, while accelerating and at full speed.
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

/** Brake, for any reason. If the release cannot be sent, end motion, which turns torque off another way. */
export function brake(): void {
  const last = doing;
  if (last === null) return;
  clearInterval(timer);
  unlisten?.();
  unlisten = null;
  doing = null;
  held.value = null;
  walking.value = 0;
  if (motion.peek().phase !== "on") return; // Torque off or stop was sent.
  if (!last.end()) endMotion(text.motion.endedByLink);
}

function say(kind: RunKind, value: number, renew: boolean): boolean {
  const present = motion.peek();
  if (present.phase !== "on") return false;
  const hold = { for_s: FOR_S, renew };
  const command = { uid: present.uid, type: kind, value, profile: null, hold };
  return live.send({ type: "command", lease: present.lease, commands: [command] });
}

/** All other ways to detect that a finger or key has left, besides the events of the button. */
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
  // Off the button; or the mouse moves without a pressed button: the release happened elsewhere.
  on(window, "pointermove", event => {
    const pointer = event as PointerEvent;
    if (heldBy === null || pointer.pointerId !== heldBy.pointerId) return;
    if ((pointer.pointerType === "mouse" && pointer.buttons === 0) || !isOn(heldBy.button, pointer)) brake();
  });
  on(window, "keydown", event => {
    if (!(event as KeyboardEvent).repeat) brake();
  });
  on(window, "keyup", brake);
  // End of motion, a question, a lost link or a refusal: cancel every press.
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

/** Tolerance for a rolling finger. */
const SLACK_PX = 16;

function isOn(button: Element, { clientX: x, clientY: y }: PointerEvent): boolean {
  const { left, top, right, bottom } = button.getBoundingClientRect();
  return x > left - SLACK_PX && x < right + SLACK_PX && y > top - SLACK_PX && y < bottom + SLACK_PX;
}

/** Run `act` with a pointer pressed on a button, captured until release. */
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

/** Run while a key is down. Repeats belong to the same press. */
export function pressByKey(event: KeyboardEvent, kind: RunKind, value: number): void {
  event.preventDefault();
  if (event.repeat || held.peek() !== null) return;
  const where = event.currentTarget as HTMLElement;
  heldBy = null;
  press(kind, value, () => where.isConnected && where.contains(document.activeElement));
}
