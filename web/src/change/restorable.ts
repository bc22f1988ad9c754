/** Which outputs can be restored, and the lease that keeps restored ones on; `restoring.ts` restores them. */
import { computed, signal } from "@preact/signals";
import { all, type KnownServo } from "../bench/fleet";
import { switchedOff } from "../bench/output";

/** Servos whose output was switched off by a session and can be restored. */
export const restorable = computed(() => all.value.filter(canRestore));

export function canRestore(one: KnownServo): boolean {
  return one.online && one.known_model && switchedOff(one.output);
}

/** The lease taken to keep outputs on. */
export const outputLease = signal<string | null>(null);
