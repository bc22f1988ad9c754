/** Live values of a servo, and whether they are stale: decided only here, by the ages from the server. */
import { telemetry } from "../telemetry/store";
import { monotonic, now } from "./clock";
import { type Angle, angleOf, type KnownServo, servo } from "./fleet";
import { up } from "./link";
import { sheetOf } from "./parameters";
import { staleAfter } from "./staleness";
import { watched } from "./telemetry-subscription";

/** A subscribed channel arrives at the granted rate; batching takes the rest of the allowance. */
const PERIODS = 2;

export interface Figure extends Angle {
  stale: boolean;
}

/** The angle of a servo, from the newer source. */
export function angleNow(one: KnownServo | undefined, at: number = now.value): Figure {
  if (!one) return { value: null, age: null, stale: true };
  return judged(one, angleOf(one, at), granted(one.uid, "current_angle") ?? staleAfter.value.angle);
}

/** Any other live value: streamed, or as polled by the server for all clients. */
export function figureNow(uid: string, key: string): Figure {
  const one = servo(uid);
  if (key === "current_angle" || !one) return angleNow(one);
  return judged(one, newest(uid, key, now.value), granted(uid, key) ?? staleAfter.value.polled);
}

/** The same for code that cannot wait for the next tick. */
export function freshAngle(one: KnownServo | undefined): number | null {
  const { value, stale } = angleNow(one, monotonic());
  return stale ? null : value;
}

function judged(one: KnownServo, found: Angle, limit: number): Figure {
  const reachable = up.value && one.online;
  return { ...found, stale: !reachable || found.value === null || found.age === null || found.age > limit };
}

function granted(uid: string, key: string): number | null {
  const grant = watched.value;
  if (grant?.uid !== uid || !grant.channels.includes(key)) return null;
  return Math.max(PERIODS / Math.max(grant.granted_hz, 0.1), staleAfter.value.angle);
}

function newest(uid: string, key: string, at: number): Angle {
  const sample = telemetry.latest(uid, key, at);
  const reading = sheetOf(uid).reading(key).value;
  const read = reading?.readAt == null ? null : at - reading.readAt;
  if (sample !== null && (read === null || sample.age <= read)) return sample;
  return { value: typeof reading?.value === "number" ? reading.value : null, age: read };
}
