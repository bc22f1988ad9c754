/** Telemetry subscriptions of the page for the servos it shows. */
import { effect, signal } from "@preact/signals";
import { callApi } from "../api/client";
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

/** Granted rates of the servo; null until the response. */
export const watched = signal<Subscription | null>(null);

/** Owner of a subscription: unique per page load, so that closing one page keeps those of others. */
const OWNER = `page-${Math.random().toString(36).slice(2, 12)}`;
/** A subscription expires this long after its page was last seen. */
const TTL_S = 10;
const AGAIN_MS = 4000;

let subscriptions = 0;

/**
 * Subscribe to channels of a servo while the tab is visible, again after each connection. `take` is called with the
 * granted rates. Returns a function that unsubscribes.
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
  // The server merges subscriptions of several owners: each gets its rates.
  const owner = `${OWNER}_${++subscriptions}`;
  let over = false;
  const put = async (wanted: readonly string[]) => {
    try {
      const grant = await callApi("PUT", "/servos/{uid}/telemetry", {
        path: { uid },
        body: { channels: wanted as readonly ParameterKey[], rate_hz: rateHz, owner, ttl_s: TTL_S },
        keepalive: wanted.length === 0,
      });
      if (!over) take(grant);
    } catch {
      // The plot shows that no data arrives; retried shortly.
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

/** Subscribe to the values shown of a servo; returns a function that unsubscribes. */
export function watch(uid: string): () => void {
  const end = subscribeTelemetry(uid, CHANNELS, RATE_HZ, grant => {
    watched.value = { uid, ...grant };
  });
  return () => {
    end();
    watched.value = null;
  };
}
