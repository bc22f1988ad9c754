/** Whether another program commands servos, or hornbill is its guest or an observer. */
import { computed } from "@preact/signals";
import { bus } from "./bench";
import { all } from "./fleet";

/** The list then shows who commands each servo. */
export const besideAutopilot = computed(
  () =>
    bus.value?.role === "guest" ||
    bus.value?.role === "observer" ||
    all.value.some(one => (one.commanded_by ?? []).length > 0),
);
