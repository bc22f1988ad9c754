/** The bus between two messages: history, and time until it is reopened. */
import { computed } from "@preact/signals";
import { BusHistory } from "../telemetry/bus-history";
import { bus } from "./bench";
import { monotonic, now } from "./clock";

export const history = new BusHistory();

let receivedAt = monotonic();

/** Record the history from now on. */
export function startBusHistory(): void {
  bus.subscribe(reported => {
    receivedAt = monotonic();
    if (reported) history.note(reported, receivedAt, Date.now() / 1000);
  });
}

/** Seconds until the adapter is reopened automatically; null while it works, or if it is not reopened. */
export const retryIn = computed(() => {
  const reported = bus.value?.retry_in_s ?? null;
  return reported === null ? null : Math.max(0, reported - Math.max(0, now.value - receivedAt));
});

/** Short name: "can0" of "socketcan:can0", "ttyACM0" of "slcan:/dev/ttyACM0". */
export function channelOf(address: string | null | undefined): string {
  const channel = address?.slice(address.indexOf(":") + 1) ?? "";
  return channel.split("/").at(-1) || channel;
}
