/** The known servos, one signal each, updated at most ten times a second. */
import { computed, type Signal, signal } from "@preact/signals";
import type { PendingAllocation, Servo } from "../api/types";
import { telemetry } from "../telemetry/store";
import { monotonic, refreshed } from "./clock";

export interface KnownServo extends Servo {
  /** When `angle_deg` was taken, monotonic, if known. */
  angleAt: number | null;
  /** When it started, monotonic, to a second; null if unknown. */
  bootAt: number | null;
}

const servos = new Map<string, Signal<KnownServo>>();
const order = signal<readonly string[]>([]);
const waiting = new Map<string, KnownServo>();
let timer: ReturnType<typeof setTimeout> | undefined;

const FLUSH_MS = 100;

/** The list has been read at least once. */
export const loaded = signal(false);
export const pending = signal<readonly (PendingAllocation & { receivedAt: number })[]>([]);

/** UIDs in list order: by servo ID, then by serial. */
export const uids = computed(() => order.value);

export const all = computed(() => uids.value.flatMap(uid => servos.get(uid)?.value ?? []));

export function servo(uid: string | null): KnownServo | undefined {
  // Reading the order, too, notifies components of a servo that appears later.
  return uid !== null && order.value.includes(uid) ? servos.get(uid)?.value : undefined;
}

export function peekServo(uid: string): KnownServo | undefined {
  return servos.get(uid)?.peek();
}

/** Display name of a servo. */
export function nameOf(one: Servo | undefined): string {
  if (!one) return "";
  return one.label || one.serial || one.name || `${one.uid.slice(0, 4)}…${one.uid.slice(-4)}`;
}

/** Replace the list by the response of GET /servos. */
export function replaceAll(list: Servo[]): void {
  const known = new Set(list.map(one => one.uid));
  for (const uid of servos.keys()) if (!known.has(uid)) servos.delete(uid);
  for (const one of list) waiting.set(one.uid, stamp(one));
  flush();
  loaded.value = true;
  if (order.peek().length !== servos.size) sort();
}

/** Replace changed servos. */
export function changeServos(list: Servo[]): void {
  for (const one of list) waiting.set(one.uid, stamp(one));
  timer ??= setTimeout(flush, FLUSH_MS);
}

function stamp(one: Servo): KnownServo {
  const at = monotonic();
  return {
    ...one,
    angleAt: one.age_s === null ? null : at - one.age_s,
    bootAt: one.uptime_s === null ? null : at - one.uptime_s,
  };
}

function flush(): void {
  refreshed();
  clearTimeout(timer);
  timer = undefined;
  let resort = false;
  for (const [uid, one] of waiting) {
    const known = servos.get(uid);
    if (!known) {
      servos.set(uid, signal(one));
      resort = true;
    } else {
      const before = known.peek();
      resort ||= before.servo_id !== one.servo_id || before.serial !== one.serial;
      known.value = one;
    }
  }
  waiting.clear();
  if (resort) sort();
}

function sort(): void {
  const place = (one: KnownServo) => (one.servo_id === null || one.servo_id === 0 ? 999 : one.servo_id);
  // Serials and UIDs are ASCII: the first localeCompare would load the collation, a tenth of the start.
  const text = (a: string, b: string) => (a < b ? -1 : Number(a > b));
  order.value = [...servos.values()]
    .map(one => one.peek())
    .sort((a, b) => place(a) - place(b) || text(a.serial ?? "", b.serial ?? "") || text(a.uid, b.uid))
    .map(one => one.uid);
}

export interface Angle {
  value: number | null;
  /** Seconds; null if never seen. */
  age: number | null;
}

/** The newest angle of a servo from either source, at the time `at` (monotonic). */
export function angleOf(one: KnownServo, at: number): Angle {
  const sample = telemetry.latest(one.uid, "current_angle", at);
  const reported = one.angleAt === null ? null : Math.max(0, at - one.angleAt);
  // Not for a silent servo: a page that loads late gets only old samples, of unknown delay.
  if (!one.online && reported !== null) return { value: one.angle_deg, age: reported };
  if (sample && (reported === null || sample.age <= reported)) return sample;
  return { value: one.angle_deg, age: reported };
}

/** True if one of the searchable fields contains the text. */
export function isFound(one: KnownServo, typed: string): boolean {
  const wanted = typed.trim().toLowerCase();
  const facts = [nameOf(one), one.serial, one.uid, one.model, one.servo_id, one.node_id];
  return wanted === "" || facts.some(fact => fact !== null && String(fact).toLowerCase().includes(wanted));
}
