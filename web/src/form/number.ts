/** Owns text ↔ number: what people type, what a row allows, and why a value is not allowed. */
import { text } from "../text";
import { decimalsOf, number, withUnit } from "./format";

export interface Span {
  unit: string;
  perUnit: number;
  minimum: number | null;
  maximum: number | null;
}

/** Either a value that may be sent, or the sentence that says why not and the nearest one that may. */
export type Checked =
  | { ok: true; value: number }
  | {
      ok: false;
      code: "empty" | "not_a_number" | "between" | "above" | "below";
      what: string;
      remedy: string;
      nearest: number | null;
    };

const SPACES = /[\s\u00a0\u2009\u202f]/g;
const UNIT = /(?:°c|°|deg|rpm|ms|µs|μs|us|s|%|v|a)$/i;
const NUMBER = /^[+-]?(?:\d+(?:\.\d*)?|\.\d+)$/;

/** The number in what was typed: comma or point, any minus sign, unit allowed; null when there is none. */
export function parseNumber(typed: string): number | null {
  const plain = typed
    .replace(SPACES, "")
    .replace(/[\u2212\u2013\u2012\uff0d]/g, "-")
    .replace(UNIT, "");
  // "1,234.5" could mean two things; a wrong guess here would move a horn.
  if (plain.includes(",") && plain.includes(".")) return null;
  const pointed = plain.replace(",", ".");
  return NUMBER.test(pointed) ? Number(pointed) : null;
}

/** Whether typed text may still become a number: nothing yet, or a sign alone. */
export function unfinished(typed: string): boolean {
  return /^[+\-\u2212]?[.,]?$/.test(typed.replace(SPACES, ""));
}

/** Checks typed text against a row. */
export function check(typed: string, span: Span): Checked {
  if (typed.trim() === "") {
    return { ok: false, code: "empty", what: text.check.empty, remedy: enter(span), nearest: null };
  }
  const value = parseNumber(typed);
  if (value === null) {
    return {
      ok: false,
      code: "not_a_number",
      what: text.check.notANumber(typed.trim()),
      remedy: enter(span),
      nearest: null,
    };
  }
  return checkValue(value, span);
}

/** Checks a number against a row: range first, then the register's step. */
export function checkValue(value: number, span: Span): Checked {
  const { minimum, maximum, perUnit } = span;
  const raw = value * perUnit;
  if (maximum !== null && raw > maximum * perUnit + 1e-6) {
    const what = text.check.above(show(value, span, 3), show(maximum, span));
    return { ok: false, code: "above", what, remedy: enter(span), nearest: maximum };
  }
  if (minimum !== null && raw < minimum * perUnit - 1e-6) {
    const what = text.check.below(show(value, span, 3), show(minimum, span));
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

/** The nearest value a row can hold. */
export function nearest(value: number, span: Span): number {
  const low = span.minimum ?? Number.NEGATIVE_INFINITY;
  const high = span.maximum ?? Number.POSITIVE_INFINITY;
  return Math.min(high, Math.max(low, Math.round(value * span.perUnit) / span.perUnit));
}

/** How far a press of an arrow key, or a notch of the wheel, goes: a unit; ten with Shift, a tenth with Alt. */
export function stepOf(span: Span, held: { shiftKey: boolean; altKey: boolean }): number {
  if (held.shiftKey) return 10;
  return held.altKey ? Math.max(0.1, 1 / span.perUnit) : 1;
}

// A typed value is shown as typed, even between two steps; a limit with the register's decimals.
function show(value: number, span: Span, extra = 0): string {
  const least = decimalsOf(span.perUnit);
  const needed = (String(Math.abs(value)).split(".")[1] ?? "").length;
  return withUnit(number(value, Math.min(least + extra, Math.max(least, extra ? needed : 0))), span.unit);
}

function enter(span: Span): string {
  if (span.minimum === null || span.maximum === null) return text.check.enterNumber;
  const decimals = decimalsOf(span.perUnit);
  return text.check.enter(
    number(span.minimum, decimals),
    withUnit(number(span.maximum, decimals), span.unit),
  );
}
