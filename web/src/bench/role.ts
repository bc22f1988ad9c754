/** Whether another program commands servos, or hornbill is its guest or an observer. */
import { computed } from "@preact/signals";
import { bus, stop } from "./bench";
import { all, type KnownServo } from "./fleet";
import { membersOf, motion } from "./motion";

/** Nothing is sent. */
export const observing = computed(() => bus.value?.role === "observer");

/** The other node that commands a servo, and since when. The first if there are several. */
export const commanderOf = (one: KnownServo) => one.commanded_by?.[0];

/** Servos that other nodes command. */
export const elsewhere = computed(() => all.value.filter(commanderOf));

/** The list then shows who commands each servo. */
export const besideAutopilot = computed(
  () => bus.value?.role === "guest" || observing.value || elsewhere.value.length > 0,
);

/** Servos that hornbill commands: for any client as guest, else for this page. */
export const commandedHere = computed<readonly string[]>(() =>
  stop.value?.reach === "own" ? stop.value.reaches : membersOf(motion.value),
);
