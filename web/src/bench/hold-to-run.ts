/** Run while a button is held: speed or torque from press to release, and every way a release shows itself. */
import { effect, signal } from "@preact/signals";
import { text } from "../text";
import { link, live, onRefusal } from "./link";
import { endMotion, motion, motionRefusal, question, setpoint, warnings } from "./motion";

export type RunKind = "speed" | "torque";

export interface RunHeld {
  kind: RunKind;
  /** rpm or %, + clockwise. */
  value: number;
}

/** What runs now, because something is held; null otherwise. */
export const held = signal<RunHeld | null>(null);

/** The server brakes by itself when it hears nothing for so long. */
export const FOR_S = 0.5;
const RENEW_MS = 120;

let timer: ReturnType<typeof setInterval> | undefined;
let unlisten: (() => void) | null = null;

/** Begins to run. `still` says whether the button is held as far as can be seen; asked eight times a second. */
export function press(kind: RunKind, value: number, still: () => boolean): void {
  const present = motion.peek();
  if (present.phase !== "on" || present.torque !== "on" || question.peek() !== null || value === 0) return;
  if (held.peek() !== null) brake();
  motionRefusal.value = null;
  warnings.value = [];
  setpoint.value = null;
  if (!say(present.lease, kind, value, false)) {
    endMotion(text.motion.endedByLink);
    return;
  }
  held.value = { kind, value };
  unlisten = listen();
  timer = setInterval(() => {
    const now = motion.peek();
    if (now.phase !== "on" || !still() || !document.hasFocus() || document.hidden) brake();
    else if (!say(now.lease, kind, value, true)) brake();
  }, RENEW_MS);
}

/** Brakes, whatever was the reason. A release that cannot be said ends motion, which takes torque by another way. */
export function brake(): void {
  const last = held.peek();
  if (last === null) return;
  clearInterval(timer);
  unlisten?.();
  unlisten = null;
  held.value = null;
  const present = motion.peek();
  if (present.phase !== "on") return; // torque off was sent, or stop was
  if (!say(present.lease, last.kind, 0, false)) endMotion(text.motion.endedByLink);
}

function say(lease: string, kind: RunKind, value: number, renew: boolean): boolean {
  const present = motion.peek();
  if (present.phase !== "on") return false;
  const hold = { for_s: FOR_S, renew };
  const command = { uid: present.uid, type: kind, value, profile: null, hold };
  return live.send({ type: "command", lease, commands: [command] });
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
  // A mouse that moves with no button pressed was released where nobody told us.
  on(window, "pointermove", event => {
    const pointer = event as PointerEvent;
    if (pointer.pointerType === "mouse" && pointer.buttons === 0 && heldByPointer) brake();
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

let heldByPointer = false;

/** Begins to run for as long as a pointer is down on `button`; the pointer is its own until then. */
export function pressByPointer(event: PointerEvent, kind: RunKind, value: number): void {
  const button = event.currentTarget as HTMLElement;
  if (event.button !== 0 || !event.isPrimary) return;
  event.preventDefault();
  button.focus();
  const { pointerId } = event;
  button.setPointerCapture(pointerId);
  heldByPointer = true;
  press(kind, value, () => button.isConnected && button.hasPointerCapture(pointerId));
}

/** Begins to run for as long as a key is down. What repeats is the same press. */
export function pressByKey(event: KeyboardEvent, kind: RunKind, value: number): void {
  event.preventDefault();
  if (event.repeat || held.peek() !== null) return;
  const where = event.currentTarget as HTMLElement;
  heldByPointer = false;
  press(kind, value, () => where.isConnected && where.contains(document.activeElement));
}
