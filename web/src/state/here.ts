/** Owns the condition of a servo as the page knows it now: servo, parameters, catalogue and stop together. */
import { telemetry } from "../telemetry/store";
import type { Limits } from "../ui/dial";
import { catalog } from "./catalog";
import { now } from "./clock";
import { type Condition, conditionOf } from "./condition";
import { connected, stop } from "./desk";
import type { KnownServo } from "./fleet";
import { up } from "./link";
import { sheetOf } from "./parameters";

export function conditionHere(servo: KnownServo): Condition {
  const sheet = sheetOf(servo.uid);
  return conditionOf(servo, {
    faults: catalog.value?.faults ?? [],
    torque: sheet.held("torque_mode"),
    temperature: servo.state === "protected" ? polled(servo, "current_temperature").value : null,
    // The time matters to a servo that is away; for the others it would only redraw.
    now: servo.online ? 0 : now.value,
    connected: connected.value,
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

/** Temperature and voltage are asked for every 2 s: old after twice that, and the time an answer is on its way. */
const POLLED_STALE_S = 5;

/** A figure the server polls seldom, from the stream or from the parameters, whichever is fresher. */
export function polled(one: KnownServo, key: string): { value: number | null; stale: boolean } {
  if (!one.online) return { value: null, stale: true };
  const at = now.value;
  const sample = telemetry.latest(one.uid, key, at);
  const reading = sheetOf(one.uid).reading(key).value;
  const told = reading?.readAt == null ? null : at - reading.readAt;
  const fromStream = sample !== null && (told === null || sample.age <= told);
  const old = fromStream ? sample.age : told;
  return {
    value: fromStream ? sample.value : asNumber(reading?.value),
    stale: !up.value || old === null || old > POLLED_STALE_S,
  };
}

function asNumber(value: unknown): number | null {
  return typeof value === "number" ? value : null;
}
