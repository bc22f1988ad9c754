/** The node ID table and pending requests, polled each second while shown. */

import { signal } from "@preact/signals";
import type { Allocation } from "../api/bus-types";
import { callApi, problemOf } from "../api/client";
import { monotonic } from "./clock";
import { problemText } from "./facts";
import { nameOf, pending, servo } from "./fleet";
import { type Poll, poll } from "./poll";

const POLL_MS = 1000;

/** Null until first read. */
export const allocations = signal<readonly Allocation[] | null>(null);
export const tableProblem = signal<string | null>(null);

/** Display name of the holder of a node ID. */
export function ownerName(uid: string): string {
  const known = servo(uid);
  return known ? nameOf(known) : `${uid.slice(0, 4)}…${uid.slice(-4)}`;
}

async function look(): Promise<void> {
  try {
    const response = await callApi("GET", "/allocations");
    const receivedAt = monotonic();
    pending.value = response.pending.map(one => ({ ...one, receivedAt }));
    allocations.value = response.allocations;
    tableProblem.value = null;
  } catch (error) {
    pending.value = [];
    tableProblem.value = problemText(problemOf(error));
  }
}

/** The table is not streamed: poll it each second. Returns a function that stops polling. */
export function watchAllocations(): Poll {
  return poll(POLL_MS, look);
}
