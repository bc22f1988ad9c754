/** State of the whole bench: bus, leases, stop latch, events. */
import { computed, signal } from "@preact/signals";
import type { Bus, EventCode, EventLevel, LeaseView, Params, Stop } from "../api/types";
import { monotonic } from "./clock";

export const bus = signal<Bus | null>(null);

/** A bus is connected; true while unknown. */
export const connected = computed(
  () => bus.value === null || (bus.value.state !== "disconnected" && bus.value.state !== "lost"),
);

export interface HeldLease extends LeaseView {
  /** End of the lease, monotonic. */
  endsAt: number;
  /** When it passes to the requesting client unless refused, monotonic; null without a request. */
  passesAt: number | null;
}

/** All leases, oldest first. One that has ended may still be here for a moment. A servo is covered by one at most. */
export const leases = signal<readonly HeldLease[]>([]);

export function setLeases(views: readonly LeaseView[]): void {
  const at = monotonic();
  leases.value = views.map(view => ({
    ...view,
    endsAt: at + view.expires_in_s,
    passesAt: view.request ? at + view.request.expires_in_s : null,
  }));
}

/** Whether a lease covers any of these servos. */
export function covers(view: Pick<LeaseView, "uids">, servos: readonly string[]): boolean {
  const { uids } = view;
  return uids === null || servos.some(uid => uids.includes(uid));
}

export const stop = signal<Stop | null>(null);
export const stopped = computed(() => stop.value?.latched ?? false);

export interface BenchEvent {
  at: number;
  level: EventLevel;
  uid: string | null;
  code: EventCode;
  text: string;
  params?: Params;
}

const KEPT = 300;

/** Newest first. */
export const events = signal<readonly BenchEvent[]>([]);

export function addEvent(event: BenchEvent): void {
  events.value = [event, ...events.peek()].slice(0, KEPT);
}
