/** Owns the condition of a servo as the page knows it now: servo, parameters, catalogue and stop together. */
import type { Limits } from "../ui/dial";
import { catalog } from "./catalog";
import { now } from "./clock";
import { type Condition, conditionOf } from "./condition";
import { stop } from "./desk";
import type { KnownServo } from "./fleet";
import { sheetOf } from "./parameters";

export function conditionHere(servo: KnownServo): Condition {
  const sheet = sheetOf(servo.uid);
  return conditionOf(servo, {
    faults: catalog.value?.faults ?? [],
    torque: sheet.held("torque_mode"),
    temperature: asNumber(sheet.held("current_temperature")),
    // The time matters to a servo that is away; for the others it would only redraw.
    now: servo.online ? 0 : now.value,
    stop: stop.value,
  });
}

/** The angle limits of a servo, null until read. */
export function limitsOf(uid: string): Limits | null {
  const sheet = sheetOf(uid);
  const cw = asNumber(sheet.held("angle_limit_cw"));
  const ccw = asNumber(sheet.held("angle_limit_ccw"));
  return cw === null || ccw === null ? null : { cw, ccw };
}

function asNumber(value: unknown): number | null {
  return typeof value === "number" ? value : null;
}
