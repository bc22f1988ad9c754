/** The bus between two messages about it: its history, and the time until it is opened again. */
import { computed } from "@preact/signals";
import { BusHistory } from "../telemetry/bus-history";
import { bus } from "./bench";
import { monotonic, now } from "./clock";

export const history = new BusHistory();

let heardAt = monotonic();

/** Keeps the history from now on. */
export function startBusHistory(): void {
  bus.subscribe(told => {
    heardAt = monotonic();
    if (told) history.note(told, heardAt, Date.now() / 1000);
  });
}

/** Seconds until the adapter is opened again by itself; null while it works, and when nobody will. */
export const retryIn = computed(() => {
  const told = bus.value?.retry_in_s ?? null;
  return told === null ? null : Math.max(0, told - Math.max(0, now.value - heardAt));
});

/** "can0" of "socketcan:can0", "ttyACM0" of "slcan:/dev/ttyACM0": what it is called on the bench. */
export function channelOf(address: string | null | undefined): string {
  const channel = address?.slice(address.indexOf(":") + 1) ?? "";
  return channel.split("/").at(-1) || channel;
}
