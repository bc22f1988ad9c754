/** State of the whole bench: bus, lease, stop latch, events. */
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

export const lease = signal<HeldLease | null>(null);

export function setLease(view: LeaseView | null | undefined): void {
  const at = monotonic();
  lease.value = view
    ? {
        ...view,
        endsAt: at + view.expires_in_s,
        passesAt: view.request ? at + view.request.expires_in_s : null,
      }
    : null;
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
