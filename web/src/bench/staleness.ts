/** Ages at which values are stale: the server's figures, so that page and server never disagree. */
import { signal } from "@preact/signals";

/** Ages in seconds above which a value is stale: the angle a servo broadcasts, and a row that is polled for everybody. */
export const staleAfter = signal({ angle: 0.5, polled: 5 });

/** Takes the figures of a hello message. */
export function takeStaleAfter(told: Readonly<Record<string, number>>): void {
  const { angle, polled } = staleAfter.peek();
  staleAfter.value = { angle: told.angle ?? angle, polled: told.status ?? polled };
}
