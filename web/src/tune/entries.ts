/** Typed numbers of the forms of Tune, and the limits of a servo in words. */
import { number, withUnit } from "../bench/format";
import { parseNumber } from "../bench/number";
import { sheetOf } from "../bench/parameters";
import { tune as words } from "./words";

/** The number, if it is one between these limits. */
export function between(typed: string, unit: string, low: number, high: number): number | null {
  const value = parseNumber(typed, unit);
  return value === null || value < low || value > high ? null : value;
}

/** "60 rpm and 40 % torque": the larger of both directions. */
export function mostOf(uid: string): string {
  const sheet = sheetOf(uid);
  const largest = (one: string, other: string) => {
    const found = [sheet.held(one), sheet.held(other)].filter(value => typeof value === "number");
    return found.length === 2 ? Math.max(...found.map(Math.abs)) : null;
  };
  const rpm = largest("speed_limit_cw", "speed_limit_ccw");
  const pct = largest("torque_limit_cw", "torque_limit_ccw");
  if (rpm === null || pct === null) return words.step.mostUnknown;
  return words.step.most(withUnit(number(rpm, 0), "rpm"), withUnit(number(pct, 0), "%"));
}
