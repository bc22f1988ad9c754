/** The current condition of a servo, from servo, parameters, catalogue and stop. */
import { connected, stop } from "./bench";
import { catalog } from "./catalog";
import { now } from "./clock";
import { type Condition, conditionOf } from "./condition";
import type { KnownServo } from "./fleet";
import { figureNow } from "./fresh";
import { sheetOf } from "./parameters";

export function conditionHere(servo: KnownServo): Condition {
  return conditionOf(servo, {
    faults: catalog.value?.faults ?? [],
    temperature: servo.state === "protected" ? figureNow(servo.uid, "current_temperature").value : null,
    // Time matters only for a servo that is offline; for the others it would only redraw.
    now: servo.online ? 0 : now.value,
    connected: connected.value,
    stop: stop.value,
  });
}

export interface Limits {
  ccw: number;
  cw: number;
}

/** Angle limits of a servo; null until read. */
export function limitsOf(uid: string): Limits | null {
  const sheet = sheetOf(uid);
  const cw = asNumber(sheet.held("angle_limit_cw"));
  const ccw = asNumber(sheet.held("angle_limit_ccw"));
  return cw === null || ccw === null ? null : { cw, ccw };
}

function asNumber(value: unknown): number | null {
  return typeof value === "number" ? value : null;
}
