/** Numbers as typed, and the verdict of a row. */
import { describe, expect, test } from "vitest";
import { angle, decimalsOf, MINUS, NARROW, number, signed, unbroken, withUnit } from "./format";
import { type AllowedSpan, check, checkValue, nearestAllowed, parseNumber, unfinishedNumber } from "./number";

const percent: AllowedSpan = { unit: "%", perUnit: 1, minimum: 0, maximum: 100 };
const degrees: AllowedSpan = { unit: "°", perUnit: 10, minimum: -180, maximum: 0 };

describe("parseNumber", () => {
  test.each([
    ["12", 12],
    ["12.5", 12.5],
    ["12,5", 12.5],
    ["-3", -3],
    ["−3", -3],
    ["–3", -3],
    ["+7.25", 7.25],
    [".5", 0.5],
    [",5", 0.5],
    ["5.", 5],
    ["1.500", 1.5],
    ["0,500", 0.5],
    ["12,50", 12.5],
    ["1 000", 1000],
    ["1\u202f234\u2009567,8", 1234567.8],
    ["７５", 75],
    ["－１２．５", -12.5],
    ["ー１２。５", -12.5],
    ["１２，５", 12.5],
    ["　７５　", 75],
  ])("%j is %d", (typed, value) => expect(parseNumber(typed, "")).toBe(value));

  test.each([
    [" 75.0 ° ", "°", 75],
    ["75deg", "°", 75],
    ["40 °C", "°C", 40],
    ["40 ℃", "°C", 40],
    ["40 c", "°C", 40],
    ["300 rpm", "rpm", 300],
    ["９．０Ｖ", "V", 9],
    ["100 %", "%", 100],
    ["１００％", "%", 100],
    ["20\u202fms", "ms", 20],
    ["20㎳", "ms", 20],
    ["1520 us", "µs", 1520],
    ["1520μs", "µs", 1520],
    ["60 °/s", "°/s", 60],
  ])("%j in %s is %d", (typed, unit, value) => expect(parseNumber(typed, unit)).toBe(value));

  test.each([
    "", "-", "abc", "1.2.3", "1e9", "0x10", "12 V 3", "--3", "Infinity", "NaN", "12 5", "1 00", "10²", "1½", "①", "٣", "5-",
  ])("%j is none", typed => expect(parseNumber(typed, "")).toBeNull()); // biome-ignore format: a list

  test.each([
    ["75 rpm", "°"],
    ["20 ms", "s"],
    ["40 °", "°C"],
    ["5 s", ""],
  ])("%j is not taken for a value in %j", (typed, unit) => {
    expect(parseNumber(typed, unit)).toBeNull();
    expect(check(typed, { ...percent, unit }).ok).toBe(false);
  });
});

/** The same numbers in every run. */
function* chances(count: number): Generator<(below: number) => number> {
  let seed = 20_261_122;
  const chance = (below: number) => {
    seed = (Math.imul(seed, 1_664_525) + 1_013_904_223) >>> 0;
    return Math.floor((seed / 2 ** 32) * below);
  };
  for (let i = 0; i < count; i++) yield chance;
}

const wide = (typed: string) =>
  typed.replace(/[!-~]/g, one => String.fromCharCode(one.charCodeAt(0) + 0xfee0)).replaceAll(" ", "\u3000");

describe("whatever is typed", () => {
  test("a number as the page writes it is read as that number, in full-width characters, too", () => {
    for (const chance of chances(3000)) {
      const perUnit = [1, 10, 100, 1000][chance(4)] ?? 1;
      const value = (chance(4_000_000) - 2_000_000) / perUnit;
      const unit = ["", "°", "%", "rpm"][chance(4)] ?? "";
      const written = withUnit(number(value, decimalsOf(perUnit)), unit);
      expect([written, parseNumber(written, unit)]).toEqual([written, value]);
      expect([written, parseNumber(wide(written.replace(MINUS, "-")), unit)]).toEqual([written, value]);
      expect(check(written, { unit, perUnit, minimum: null, maximum: null })).toEqual({ ok: true, value });
    }
  });

  test("a decimal comma is read as a point, but for the one that could group thousands, which is refused", () => {
    for (const chance of chances(3000)) {
      const whole = String(chance(5000));
      const fraction = String(chance(100_000)).padStart(1 + chance(5), "0");
      const doubtful = fraction.length === 3 && whole.length <= 3 && whole !== "0";
      const read = parseNumber(`${whole},${fraction}`, "");
      expect([whole, fraction, read]).toEqual([
        whole,
        fraction,
        doubtful ? null : Number(`${whole}.${fraction}`),
      ]);
    }
  });

  test("it is never misread: what is read has no more in it than digits, one separator and whole groups", () => {
    const letters = [
      "0",
      "1",
      "5",
      "9",
      "０",
      "５",
      ".",
      ",",
      "．",
      "，",
      "-",
      "－",
      "ー",
      " ",
      "　",
      "²",
      "e",
      "°",
    ];
    let understood = 0;
    for (const chance of chances(40_000)) {
      const typed = Array.from({ length: 1 + chance(8) }, () => letters[chance(letters.length)]).join("");
      const value = parseNumber(typed, "°");
      if (value === null) continue;
      understood += 1;
      const ascii = typed
        .replace(/[！-～]/g, one => String.fromCharCode(one.charCodeAt(0) - 0xfee0))
        .replaceAll("ー", "-")
        .replaceAll("　", " ")
        .trim()
        .replace(/ *°$/, "");
      const digits = ascii.replace(/^(-?) */, "$1");
      expect([typed, digits]).toEqual([typed, expect.stringMatching(/^-?[\d ]*([.,]\d*)?$/)]);
      for (const group of digits.replace(/^-/, "").split(/[.,]/)[0]?.split(/ +/).slice(1) ?? []) {
        expect([typed, group.length]).toEqual([typed, 3]);
      }
      expect([typed, value]).toEqual([typed, Number(digits.replace(/ +/g, "").replace(",", "."))]);
    }
    expect(understood).toBeGreaterThan(2000);
  });
});

describe("unfinished", () => {
  test.each(["", "-", "−", "+", ".", "-.", "－", "ー", "　"])("%j may become a number", typed =>
    expect(unfinishedNumber(typed)).toBe(true),
  );
  test.each(["1", "a", "-1"])("%j is finished", typed => expect(unfinishedNumber(typed)).toBe(false));
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
      what: `120${NARROW}% is above this model's limit of 100${NARROW}%.`,
      remedy: `Enter 0 to 100${NARROW}%.`,
      nearest: 100,
    });
  });

  test("below", () => {
    const verdict = check("-200", degrees);
    expect(verdict).toMatchObject({ ok: false, code: "below", nearest: -180 });
    expect(verdict.ok ? "" : verdict.what).toBe(
      `${MINUS}200.0° is below this model's limit of ${MINUS}180.0°.`,
    );
  });

  test("a servo's own angle limits are not called its model's", () => {
    const own: AllowedSpan = { ...degrees, maximum: 179.9, limits: "angle" };
    expect(checkValue(400, own)).toMatchObject({
      code: "above",
      what: "400.0° is beyond the CW angle limit of 179.9° (0x38).",
    });
    expect(checkValue(-200, own)).toMatchObject({
      code: "below",
      what: `${MINUS}200.0° is beyond the CCW angle limit of ${MINUS}180.0° (0x39).`,
    });
  });

  test.each([
    ["1,500", 3000, 1, [1500], "Enter 1500 or 1.5."],
    ["-1,500", 3000, 10, [-1500, -1.5], `Enter ${MINUS}1500 or ${MINUS}1.5.`],
    ["１，５００", 100, 10, [1.5], "Enter 1500 or 1.5."],
    ["1,234.5", 3000, 10, [1234.5], "Enter 1234.5."],
    ["1.234,5", 3000, 10, [1234.5], "Enter 1234.5."],
    ["1,234,567", 3000, 1, [], "Enter 1234567."],
  ])(
    "%j can be read in more than one way: all are named, those that may be sent are offered",
    (typed, most, perUnit, readings, remedy) => {
      const verdict = check(typed, { unit: "rpm", perUnit, minimum: -most, maximum: most });
      expect(verdict).toMatchObject({ ok: false, code: "ambiguous", nearest: null, readings, remedy });
    },
  );

  test("another unit than the row's is said", () => {
    const verdict = check("20 ms", { ...percent, unit: "s" });
    expect(verdict).toMatchObject({ ok: false, code: "unit", what: "This value is in s, not in ms." });
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
    const span: AllowedSpan = { unit: "V", perUnit: 10, minimum: 4.1, maximum: 8.7 };
    expect(checkValue(4.1, span)).toEqual({ ok: true, value: 4.1 });
    expect(checkValue(8.7, span)).toEqual({ ok: true, value: 8.7 });
    expect(checkValue(8.70001, span)).toMatchObject({ ok: false, code: "above" });
  });

  test("nearest is legal", () => {
    expect(nearestAllowed(12.34, degrees)).toBe(0);
    expect(nearestAllowed(-12.34, degrees)).toBe(-12.3);
    expect(nearestAllowed(-999, degrees)).toBe(-180);
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
