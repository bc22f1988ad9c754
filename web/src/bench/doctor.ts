/** Findings of the doctor: polled often on the Bus page, and now and then on the others. */

import { computed } from "@preact/signals";
import type { Finding } from "../api/bus-types";
import { callApi } from "../api/client";
import type { Poll } from "./poll";
import { CommonResource } from "./resource";

const PLACE: Record<Finding["severity"], number> = { failure: 0, warning: 1, notice: 2, ok: 3 };

/** Worst first; otherwise in the order of the server. */
export function findingsInOrder(list: readonly Finding[]): Finding[] {
  return [...list].sort((one, other) => PLACE[one.severity] - PLACE[other.severity]);
}

/** Findings of the last check. */
export const doctor: CommonResource<Finding[]> = new CommonResource(async () =>
  findingsInOrder(await callApi("GET", "/bus/doctor", { query: { all: doctor.often } })),
);

export const findings = computed(() => doctor.value.value ?? []);

/** Number of findings that need attention, by severity. */
export const complaints = computed(() => ({
  failure: findings.value.filter(one => one.severity === "failure").length,
  warning: findings.value.filter(one => one.severity === "warning").length,
}));

const OFTEN_MS = 3000;
const SELDOM_MS = 15_000;

/** Poll slowly, for the badge in the rail. */
export function startDoctor(): void {
  doctor.start(SELDOM_MS);
}

/** Poll every few seconds, including passed checks. */
export function watchDoctor(): Poll {
  return doctor.watch(OFTEN_MS);
}
