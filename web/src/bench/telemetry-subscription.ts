/** What the server is asked to poll while somebody looks at a servo. */
import { effect, signal } from "@preact/signals";
import { ask } from "../api/client";
import type { ParameterKey, TelemetryGrant } from "../api/types";
import { connection, up } from "./link";

export const CHANNELS = [
  "current_angle",
  "command_angle",
  "current_speed",
  "current_torque",
  "current_temperature",
  "current_voltage",
];
export const RATE_HZ = 20;

export interface Subscription extends TelemetryGrant {
  uid: string;
}

/** What was granted for the servo looked at; null until answered. */
export const watched = signal<Subscription | null>(null);

/** Whose wish it is: every page load has its own, so that closing one leaves those of others alone. */
const OWNER = `page-${Math.random().toString(36).slice(2, 12)}`;
/** A wish ends by itself so long after the page that made it was last heard of. */
const TTL_S = 10;
const AGAIN_MS = 4000;

let wishes = 0;

/**
 * Has channels of a servo polled while the tab is looked at, said anew after each connection. `take` is told what is
 * granted. The answer ends it, and what it took of the bus is free again.
 */
export function subscribeTelemetry(
  uid: string,
  channels: readonly string[],
  rateHz: number,
  take: (grant: TelemetryGrant) => void,
): () => void {
  const shown = signal(!document.hidden);
  const look = () => {
    shown.value = !document.hidden;
  };
  document.addEventListener("visibilitychange", look);
  // The server unites the wishes of several owners: each gets what it asked for.
  const owner = `${OWNER}_${++wishes}`;
  let over = false;
  const put = async (wanted: readonly string[]) => {
    try {
      const grant = await ask("PUT", "/servos/{uid}/telemetry", {
        path: { uid },
        body: { channels: wanted as readonly ParameterKey[], rate_hz: rateHz, owner, ttl_s: TTL_S },
        keepalive: wanted.length === 0,
      });
      if (!over) take(grant);
    } catch {
      // The plot says that nothing comes; it is asked for again soon.
    }
  };
  const end = effect(() => {
    const wanted = up.value && shown.value && connection.value > 0;
    if (!wanted) return undefined;
    const say = () => void put(channels);
    say();
    const again = setInterval(say, AGAIN_MS);
    return () => clearInterval(again);
  });
  return () => {
    over = true;
    end();
    document.removeEventListener("visibilitychange", look);
    void put([]);
  };
}

/** Polls what is shown of a servo that is looked at; the answer ends it. */
export function watch(uid: string): () => void {
  const end = subscribeTelemetry(uid, CHANNELS, RATE_HZ, grant => {
    watched.value = { uid, ...grant };
  });
  return () => {
    end();
    watched.value = null;
  };
}
