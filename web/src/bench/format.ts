/** Formatting of values: decimals of the register's step, U+2212, units after a narrow space. */
import type { Value } from "../api/types";
import { text } from "../text";

export const MINUS = "\u2212";
export const NARROW = "\u202f";
/** Shown for unknown values; keeps the width. */
export const NONE = "\u2013";

/** Decimals of a row with this many raw counts per unit: 10 gives one. */
export function decimalsOf(perUnit: number): number {
  return Math.max(0, Math.ceil(Math.log10(perUnit) - 1e-9));
}

/** "−12.1": a true minus sign, never "−0.0". */
export function number(value: number, decimals: number): string {
  const digits = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(digits) !== 0 ? MINUS + digits : digits;
}

/** "+12.1", "−12.1", "0.0". */
export function signed(value: number, decimals: number): string {
  const plain = number(value, decimals);
  return value > 0 && Number(plain) !== 0 ? `+${plain}` : plain;
}

/** A number with its unit: the degree sign without a space, other units after a narrow one. */
export function withUnit(digits: string, unit: string): string {
  if (unit === "") return digits;
  return unit === "°" ? digits + unit : digits + NARROW + unit;
}

/** A sentence of the tables, with non-breaking spaces between numbers and units. */
export function unbroken(sentence: string): string {
  return sentence.replace(/(?<=\d) (?=(?:°C|V|A|ms|s|rpm|Hz|%)(?![\w%]))/g, NARROW);
}

/** "+12.4°", or a dash with a degree sign if unknown. */
export function angle(value: number | null | undefined): string {
  return value === null || value === undefined ? `${NONE}°` : withUnit(signed(value, 1), "°");
}

/** "8 214 806": an integer in groups of three. */
export function grouped(value: number): string {
  return number(Math.round(value), 0).replace(/\B(?=(\d{3})+$)/g, NARROW);
}

/** "640 B", "12.3 kB", "1.25 GB": decimal multiples. */
export function size(bytes: number): string {
  if (bytes < 1000) return withUnit(String(bytes), "B");
  const units = ["kB", "MB", "GB"];
  let place = 0;
  let value = bytes / 1000;
  while (value >= 999.5 && place < units.length - 1) {
    value /= 1000;
    place += 1;
  }
  return withUnit(number(value, value < 9.95 ? 2 : value < 99.95 ? 1 : 0), units[place] ?? "");
}

/** "0.1 s", "14 s", "3 min", "2 h". `decimals` 0: steady enough for a sentence. */
export function age(seconds: number, decimals = 1): string {
  if (seconds < 9.95) return withUnit(seconds.toFixed(decimals), "s");
  if (seconds < 120) return withUnit(String(Math.floor(seconds)), "s");
  if (seconds < 7200) return withUnit(String(Math.floor(seconds / 60)), "min");
  return withUnit(String(Math.floor(seconds / 3600)), "h");
}

/** "14:02:31" in local time; with `millis` "14:02:31.009". */
export function clock(utc: number, millis = false): string {
  const at = new Date(utc * 1000);
  const pair = (n: number) => String(n).padStart(2, "0");
  const base = `${pair(at.getHours())}:${pair(at.getMinutes())}:${pair(at.getSeconds())}`;
  return millis ? `${base}.${String(at.getMilliseconds()).padStart(3, "0")}` : base;
}

/** "14:01". */
export function minute(utc: number): string {
  return clock(utc).slice(0, 5);
}

/** "2026-03-01". */
export function date(utc: number): string {
  const at = new Date(utc * 1000);
  const pair = (n: number) => String(n).padStart(2, "0");
  return `${at.getFullYear()}-${pair(at.getMonth() + 1)}-${pair(at.getDate())}`;
}

interface Shape {
  unit: string;
  perUnit: number;
  kind: string;
  choices: readonly { key: string; label: string }[];
  /** The sign is the direction, so positive values have one, too. */
  sided?: boolean;
}

/** A value of a row without its unit. */
export function bare(value: Value | undefined, shape: Shape): string {
  if (value === null || value === undefined) return NONE;
  if (typeof value === "boolean") return value ? text.on : text.off;
  if (typeof value === "string") return shape.choices.find(one => one.key === value)?.label ?? value;
  return number(value, decimalsOf(shape.perUnit));
}

/** A value of a row with its unit. */
export function full(value: Value | undefined, shape: Shape): string {
  if (typeof value !== "number") return bare(value, shape);
  const show = shape.sided ? signed : number;
  return withUnit(show(value, decimalsOf(shape.perUnit)), shape.unit);
}
