/** The benches of a site: the servers that share this database, polled often on the Site page, and now and then on the others. */

import { computed } from "@preact/signals";
import { callApi } from "../api/client";
import type { Bench } from "../api/config-types";
import type { Poll } from "./poll";
import { CommonResource } from "./resource";

const OFTEN_MS = 2000;
const SELDOM_MS = 15_000;

export const benches = new CommonResource<readonly Bench[]>(() => callApi("GET", "/benches"));

/** This server's bench. */
export const thisBench = computed(() => benches.value.value?.find(one => one.is_this) ?? null);

/** Time since the last contact of a bench, s, by the clock of the server. */
export function sinceContact(bench: Bench): number {
  return Math.max(0, (thisBench.value ?? bench).last_contact - bench.last_contact);
}

/** Several benches share the database: only then does the page name them. */
export const severalBenches = computed(() => (benches.value.value?.length ?? 0) > 1);

/** Benches that stopped responding without having been shut down. */
export const silentBenches = computed(
  () => benches.value.value?.filter(one => one.state === "no_contact").length ?? 0,
);

/** Poll slowly, for the rail and the bar. */
export function startSite(): void {
  benches.start(SELDOM_MS);
}

/** Poll every few seconds. */
export function watchSite(): Poll {
  return benches.watch(OFTEN_MS);
}
