/** Parsing and validation of typed numbers. */
import { text } from "../text";
import { decimalsOf, number, withUnit } from "./format";

export interface AllowedSpan {
  unit: string;
  perUnit: number;
  minimum: number | null;
  maximum: number | null;
  /** Set if the range is that of the servo's angle limits, not of its model. */
  limits?: "angle";
}

/** Why a value may not be sent, and what to enter instead. */
export interface NotAllowed {
  ok: false;
  code: "empty" | "not_a_number" | "ambiguous" | "unit" | "between" | "above" | "below";
  what: string;
  remedy: string;
  /** The nearest valid value. */
  nearest: number | null;
  /** Valid readings of an ambiguous number. */
  readings?: readonly number[];
}

export type Checked = { ok: true; value: number } | NotAllowed;

/**
 * What a text says as a number. The rules:
 *
 * 1. Point and comma are both decimal separators. Thousands are grouped with spaces alone, as the page itself writes them.
 * 2. A comma that could group thousands ("1,500", "1,234.5") is not read: both readings are offered.
 * 3. Full-width characters, any minus sign, and the marks of a Japanese keyboard count as their plain ones.
 * 4. A unit may follow, if it is the unit of the row.
 */
type Read =
  | { as: "number"; value: number }
  | { as: "ambiguous"; readings: readonly number[] }
  | { as: "unit"; unit: string }
  | { as: "nothing" };

/** Full-width forms and signs like ℃ and ㎳. Not all of NFKC: it would turn "10²" into 102. */
const WIDE = /[\uff01-\uff5e\u2103\u3371-\u33df]/g;
const PLAIN: readonly (readonly [RegExp, string])[] = [
  [/\s+/g, " "],
  [/[\u2212\u2010-\u2015\u30fc]/g, "-"],
  [/[\u3002\uff61]/g, "."],
  [/[\u3001\uff64]/g, ","],
  [/[\u00b5\u03bc]/g, "u"],
];

function plain(typed: string): string {
  const narrow = typed.replace(WIDE, one => one.normalize("NFKC"));
  return PLAIN.reduce((before, [pattern, by]) => before.replace(pattern, by), narrow).trim();
}

const DIGITS = String.raw`\d{1,3}(?: \d{3})+|\d+`;
const NUMBER = new RegExp(String.raw`^([+-]?) ?(?:(${DIGITS})(?:[.,](\d*))?|[.,](\d+))$`);
const GROUPED = /^[+-]? ?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d+)?$|^[+-]? ?[1-9]\d{0,2}(?:\.\d{3})+,\d+$/;
const WITH_UNIT = /^(.*?[\d.,]) ?([a-z%°][a-z%°/]*)$/i;

const OTHER_NAMES: Readonly<Record<string, string>> = { deg: "°", "deg/s": "°/s", c: "°c" };
const UNITS: ReadonlySet<string> = new Set([
  "°",
  "°/s",
  "°c",
  "rpm",
  "s",
  "ms",
  "us",
  "%",
  "v",
  "a",
  "kbit/s",
  "mb",
]);

function unitOf(word: string): string {
  const small = plain(word).toLowerCase();
  return OTHER_NAMES[small] ?? small;
}

function read(typed: string, unit: string): Read {
  const whole = plain(typed);
  const [, digits = whole, word] = WITH_UNIT.exec(whole) ?? [];
  if (!NUMBER.test(digits) && !GROUPED.test(digits)) return { as: "nothing" };
  if (word !== undefined && unitOf(word) !== unitOf(unit)) {
    return UNITS.has(unitOf(word)) ? { as: "unit", unit: word } : { as: "nothing" };
  }
  if (GROUPED.test(digits)) return { as: "ambiguous", readings: readings(digits) };
  const [, sign, integer = "", fraction, alone] = NUMBER.exec(digits) ?? [];
  const value = Number(`${integer.replaceAll(" ", "") || "0"}.${fraction ?? alone ?? ""}0`);
  return { as: "number", value: sign === "-" ? -value : value };
}

/** Readings of an ambiguous number: "1,500" has two, "1,234.5" and "1,234,567" one. */
function readings(digits: string): readonly number[] {
  const bare = digits.replace(" ", "");
  const grouping = bare.includes(",") && !/\..*,/.test(bare) ? "," : ".";
  const grouped = Number(bare.replaceAll(grouping, "").replace(",", "."));
  return /^[+-]?\d+,\d+$/.test(bare) ? [grouped, Number(bare.replace(",", "."))] : [grouped];
}

/** Parse a typed value of this unit; null if invalid or ambiguous. */
export function parseNumber(typed: string, unit: string): number | null {
  const found = read(typed, unit);
  return found.as === "number" ? found.value : null;
}

/** Parse a non-negative integer, such as an ID; null for anything else. */
export function wholeNumber(typed: string): number | null {
  const value = parseNumber(typed, "");
  return value !== null && Number.isInteger(value) && value >= 0 ? value : null;
}

/** True if the text may still become a number: empty, or a sign alone. */
export function unfinishedNumber(typed: string): boolean {
  return /^[+-]? ?[.,]?$/.test(plain(typed));
}

/** Check typed text against a row. */
export function check(typed: string, span: AllowedSpan): Checked {
  const refused = (code: NotAllowed["code"], what: string, remedy = enter(span)): NotAllowed => ({
    ok: false,
    code,
    what,
    remedy,
    nearest: null,
  });
  if (typed.trim() === "") return refused("empty", text.check.empty);
  const found = read(typed, span.unit);
  switch (found.as) {
    case "number":
      return checkValue(found.value, span);
    case "unit":
      return refused("unit", text.check.otherUnit(found.unit, span.unit));
    case "nothing":
      return refused("not_a_number", text.check.notANumber(typed.trim()));
    case "ambiguous": {
      const [one = "", other = ""] = found.readings.map(value => number(value, written(value)));
      const remedy = other === "" ? text.check.enterOne(one) : text.check.either(one, other);
      const allowed = found.readings.filter(value => checkValue(value, span).ok);
      return { ...refused("ambiguous", text.check.ambiguous(typed.trim()), remedy), readings: allowed };
    }
  }
}

/** Check a number against a row: range first, then step. */
export function checkValue(value: number, span: AllowedSpan): Checked {
  const { minimum, maximum, perUnit } = span;
  const raw = value * perUnit;
  if (maximum !== null && raw > maximum * perUnit + 1e-6) {
    const [shown, limit] = [show(value, span, 3), show(maximum, span)];
    const what = span.limits
      ? text.motion.pastLimit.angle_limit_cw(shown, limit, "0x38")
      : text.check.above(shown, limit);
    return { ok: false, code: "above", what, remedy: enter(span), nearest: maximum };
  }
  if (minimum !== null && raw < minimum * perUnit - 1e-6) {
    const [shown, limit] = [show(value, span, 3), show(minimum, span)];
    const what = span.limits
      ? text.motion.pastLimit.angle_limit_ccw(shown, limit, "0x39")
      : text.check.below(shown, limit);
    return { ok: false, code: "below", what, remedy: enter(span), nearest: minimum };
  }
  const whole = Math.round(raw);
  if (Math.abs(raw - whole) > 1e-6) {
    const low = show(Math.floor(raw) / perUnit, span);
    const high = show(Math.ceil(raw) / perUnit, span);
    const what = text.check.between(show(value, span, 3), show(1 / perUnit, span));
    return {
      ok: false,
      code: "between",
      what,
      remedy: text.check.either(low, high),
      nearest: whole / perUnit,
    };
  }
  return { ok: true, value: whole / perUnit };
}

/** The nearest valid value of a row. */
export function nearestAllowed(value: number, span: AllowedSpan): number {
  const low = span.minimum ?? Number.NEGATIVE_INFINITY;
  const high = span.maximum ?? Number.POSITIVE_INFINITY;
  return Math.min(high, Math.max(low, Math.round(value * span.perUnit) / span.perUnit));
}

/** Step of an arrow key or wheel notch: one unit; ten with Shift, a tenth with Alt. */
export function stepOf(span: AllowedSpan, held: { shiftKey: boolean; altKey: boolean }): number {
  if (held.shiftKey) return 10;
  return held.altKey ? Math.max(0.1, 1 / span.perUnit) : 1;
}

// A typed value is shown as typed; a limit with the register's decimals.
function show(value: number, span: AllowedSpan, extra = 0): string {
  const least = decimalsOf(span.perUnit);
  const digits = Math.min(least + extra, Math.max(least, extra ? written(value) : 0));
  return withUnit(number(value, digits), span.unit);
}

/** Decimals needed to write a number exactly. */
function written(value: number): number {
  return (String(Math.abs(value)).split(".")[1] ?? "").length;
}

function enter(span: AllowedSpan): string {
  if (span.minimum === null || span.maximum === null) return text.check.enterNumber;
  const decimals = decimalsOf(span.perUnit);
  return text.check.enter(
    number(span.minimum, decimals),
    withUnit(number(span.maximum, decimals), span.unit),
  );
}
