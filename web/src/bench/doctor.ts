/** The doctor's findings: asked often while the Bus page is open, and now and then on any other. */

import { computed } from "@preact/signals";
import type { Finding } from "../api/bus-types";
import { ask } from "../api/client";
import { type Poll, poll } from "./poll";
import { Resource } from "./resource";

const PLACE: Record<Finding["severity"], number> = { failure: 0, warning: 1, notice: 2, ok: 3 };

/** The worst first; among equals as the doctor told them. */
export function findingsInOrder(list: readonly Finding[]): Finding[] {
  return [...list].sort((one, other) => PLACE[one.severity] - PLACE[other.severity]);
}

/** What the doctor found. */
export const doctor = new Resource(async () =>
  findingsInOrder(await ask("GET", "/bus/doctor", { query: { all: watching > 0 } })),
);

export const findings = computed(() => doctor.value.value ?? []);

/** How many findings call for somebody, by severity. */
export const complaints = computed(() => ({
  failure: findings.value.filter(one => one.severity === "failure").length,
  warning: findings.value.filter(one => one.severity === "warning").length,
}));

const OFTEN_MS = 3000;
const SELDOM_MS = 15_000;

let watching = 0;

/** Looks now and then, for the sign in the rail. */
export function startDoctor(): void {
  poll(SELDOM_MS, async () => {
    if (watching === 0) await doctor.load();
  });
}

/** Looks every few seconds, at what is well too. */
export function watchDoctor(): Poll {
  watching += 1;
  const often = doctor.watch(OFTEN_MS);
  return {
    now: often.now,
    end: () => {
      watching -= 1;
      often.end();
    },
  };
}
