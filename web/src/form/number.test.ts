/** What people type as numbers, and what a row answers. */
import { describe, expect, test } from "vitest";
import { angle, decimalsOf, MINUS, NARROW, number, signed, unbroken, withUnit } from "./format";
import { check, checkValue, nearest, parseNumber, type Span, unfinished } from "./number";

const percent: Span = { unit: "%", perUnit: 1, minimum: 0, maximum: 100 };
const degrees: Span = { unit: "°", perUnit: 10, minimum: -180, maximum: 0 };

describe("parseNumber", () => {
  test.each([
    ["12", 12],
    ["12.5", 12.5],
    ["12,5", 12.5],
    ["-3", -3],
    ["−3", -3],
    ["–3", -3],
    ["+7.25", 7.25],
    [" 75.0 ° ", 75],
    ["75°", 75],
    ["40 °C", 40],
    ["300 rpm", 300],
    ["9,0 V", 9],
    ["100 %", 100],
    ["1 000", 1000],
    ["20\u202fms", 20],
    [".5", 0.5],
    ["5.", 5],
  ])("%j is %d", (typed, value) => expect(parseNumber(typed)).toBe(value));

  test.each(["", "-", "abc", "1,234.5", "1.2.3", "1e9", "0x10", "12 V 3", "--3", "Infinity", "NaN"])(
    "%j is none",
    typed => expect(parseNumber(typed)).toBeNull(),
  );
});

describe("unfinished", () => {
  test.each(["", "-", "−", "+", ".", "-."])("%j may become a number", typed =>
    expect(unfinished(typed)).toBe(true),
  );
  test.each(["1", "a", "-1"])("%j is finished", typed => expect(unfinished(typed)).toBe(false));
});

describe("check", () => {
  test("a legal value", () => {
    expect(check("75,0", { ...degrees, minimum: 0, maximum: 180 })).toEqual({ ok: true, value: 75 });
    expect(check("−0.1", degrees)).toEqual({ ok: true, value: -0.1 });
  });

  test("above: value, limit, remedy, and the nearest legal value", () => {
    expect(check("120", percent)).toEqual({
      ok: false,
      code: "above",
      what: `120${NARROW}% is above the 100${NARROW}% this model allows.`,
      remedy: `Enter 0 to 100${NARROW}%.`,
      nearest: 100,
    });
  });

  test("below", () => {
    const verdict = check("-200", degrees);
    expect(verdict).toMatchObject({ ok: false, code: "below", nearest: -180 });
    expect(verdict.ok ? "" : verdict.what).toBe(
      `${MINUS}200.0° is below the ${MINUS}180.0° this model allows.`,
    );
  });

  test("between two steps of the register", () => {
    const verdict = check("-12.34", degrees);
    expect(verdict).toMatchObject({ ok: false, code: "between", nearest: -12.3 });
    expect(verdict.ok ? "" : verdict.remedy).toBe(`Enter ${MINUS}12.4° or ${MINUS}12.3°.`);
  });

  test("nothing, and no number", () => {
    expect(check("  ", percent)).toMatchObject({ ok: false, code: "empty" });
    expect(check("abc", percent)).toMatchObject({
      ok: false,
      code: "not_a_number",
      what: "“abc” is not a number.",
    });
  });

  test("the ends of the range are inside it, in spite of binary fractions", () => {
    const span: Span = { unit: "V", perUnit: 10, minimum: 4.1, maximum: 8.7 };
    expect(checkValue(4.1, span)).toEqual({ ok: true, value: 4.1 });
    expect(checkValue(8.7, span)).toEqual({ ok: true, value: 8.7 });
    expect(checkValue(8.70001, span)).toMatchObject({ ok: false, code: "above" });
  });

  test("nearest is legal", () => {
    expect(nearest(12.34, degrees)).toBe(0);
    expect(nearest(-12.34, degrees)).toBe(-12.3);
    expect(nearest(-999, degrees)).toBe(-180);
  });
});

describe("format", () => {
  test("a real minus sign, and no minus before zero", () => {
    expect(number(-12.1, 1)).toBe("−12.1");
    expect(number(-0.04, 1)).toBe("0.0");
    expect(signed(0.04, 1)).toBe("0.0");
    expect(signed(12.4, 1)).toBe("+12.4");
  });

  test("the degree sign stands tight, other units after a narrow space", () => {
    expect(angle(-12.1)).toBe("−12.1°");
    expect(angle(null)).toBe("–°");
    expect(withUnit("7.4", "V")).toBe("7.4\u202fV");
    expect(withUnit("3", "")).toBe("3");
    expect(unbroken("±5 °C after 300 ms, 2 servos, 3 seconds")).toBe(
      "±5\u202f°C after 300\u202fms, 2 servos, 3 seconds",
    );
  });

  test("decimals follow the register's step", () => {
    expect([1, 10, 100, 1000].map(decimalsOf)).toEqual([0, 1, 2, 3]);
  });
});
