/** Ages at which values are stale, from the server, so that both agree. */
import { signal } from "@preact/signals";

/** Ages in seconds above which a value is stale: a broadcast angle, and a polled row. */
export const staleAfter = signal({ angle: 0.5, polled: 5 });

/** Take the ages from a hello message. */
export function takeStaleAfter(reported: Readonly<Record<string, number>>): void {
  const { angle, polled } = staleAfter.peek();
  staleAfter.value = { angle: reported.angle ?? angle, polled: reported.status ?? polled };
}
