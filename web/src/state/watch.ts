/** Owns what the server is asked to poll while somebody looks at a servo. */
import { effect, signal } from "@preact/signals";
import { ask } from "../api/client";
import type { TelemetryGrant } from "../api/types";
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

export interface Watched extends TelemetryGrant {
  uid: string;
}

/** What was granted for the servo looked at; null until answered. */
export const watched = signal<Watched | null>(null);

async function wish(uid: string, channels: string[]): Promise<void> {
  try {
    const grant = await ask<TelemetryGrant>("PUT", `/servos/${uid}/telemetry`, {
      body: { channels, rate_hz: RATE_HZ },
      keepalive: channels.length === 0,
    });
    if (channels.length > 0) watched.value = { uid, ...grant };
  } catch {
    // The plot says that nothing comes; the next connection asks again.
  }
}

/** Polls a servo while the tab is looked at, anew after each connection; the answer ends it. */
export function watch(uid: string): () => void {
  const shown = signal(!document.hidden);
  const look = () => {
    shown.value = !document.hidden;
  };
  document.addEventListener("visibilitychange", look);
  const end = effect(() => {
    const wanted = up.value && shown.value && connection.value > 0;
    if (wanted) void wish(uid, CHANNELS);
  });
  return () => {
    end();
    document.removeEventListener("visibilitychange", look);
    watched.value = null;
    void wish(uid, []);
  };
}

/** Values older than this are old: twice the period, and never less than a batch may take on its way. */
export function staleAfter(grantedHz: number): number {
  return Math.max(2 / Math.max(grantedHz, 0.1), 0.4);
}
