/** The step to do now, and the cause of each result. */
import { describe, expect, test } from "vitest";
import type { Verification, VerifyRow } from "../api/autopilot-types";
import { causeOf, countsOf, halfRange, nextStep, presentStep, silent, toneOf, unitsOf } from "./verification";

function row(output: number, change: Partial<VerifyRow> = {}): VerifyRow {
  return {
    output,
    servo_id: output,
    label: `Servo ${output}`,
    low_deg: -36,
    high_deg: 25.2,
    neutral_deg: 0,
    positive_deg: 25.2,
    last_deg: 0,
    seen_low_deg: 0,
    seen_high_deg: 0,
    held_deg: null,
    result: "not_moved",
    swapped_with: null,
    ...change,
  };
}

const three = (...results: VerifyRow["result"][]) =>
  results.map((result, index) => row(index + 1, { result }));

describe("The next step", () => {
  test("is neutral first, then each output without a result", () => {
    expect(nextStep(three("not_moved", "not_moved", "not_moved"), false)).toEqual({
      kind: "neutral",
      output: null,
      n: 1,
      of: 4,
    });
    expect(nextStep(three("not_moved", "not_moved", "not_moved"), true)).toMatchObject({ output: 1, n: 2 });
    expect(nextStep(three("matches", "not_moved", "not_moved"), true)).toMatchObject({ output: 2, n: 3 });
    expect(nextStep(three("matches", "reversed", "throw_too_small"), true)).toBeNull();
  });

  test("skips outputs that no control can move", () => {
    expect(nextStep(three("missing", "wrong_type", "not_moved"), true)).toMatchObject({
      output: 3,
      n: 2,
      of: 2,
    });
    expect(nextStep(three("missing", "missing", "missing"), false)).toBeNull();
  });

  test("does not return to neutral after a reload, when outputs are measured", () => {
    expect(nextStep(three("matches", "not_moved", "not_moved"), false)).toMatchObject({ kind: "positive" });
  });

  test("keeps its number while it is measured again", () => {
    const state = {
      step: "positive",
      output: 2,
      rows: three("matches", "reversed", "not_moved"),
    } as Verification;
    expect(presentStep(state)).toMatchObject({ kind: "positive", output: 2, n: 3, of: 4 });
    expect(presentStep({ ...state, step: null })).toBeNull();
  });
});

test("results are counted by tone", () => {
  const list = three("matches", "reversed", "throw_too_small");
  expect(countsOf([...list, row(4)])).toEqual({ ok: 1, failure: 1, warning: 1, none: 1 });
  expect(toneOf({ result: "throw_too_large" })).toBe("failure");
});

test("a bus without ArrayCommand is silent, one with another type is not", () => {
  expect(silent([row(1, { last_deg: null }), row(2, { last_deg: null })])).toBe(true);
  expect(silent([row(1, { last_deg: null, result: "wrong_type" })])).toBe(false);
});

describe("The cause names the parameter to change", () => {
  const list = [row(1), row(3)];

  test.each([
    [{ result: "matches", held_deg: 25.1 }, "Within 0.1° of the exported end."],
    [{ result: "reversed", held_deg: -36 }, "Set SERVO3_REVERSED to 0, as exported."],
    [{ result: "reversed", positive_deg: -36, held_deg: 25.2 }, "Set SERVO3_REVERSED to 1, as exported."],
    [{ result: "missing" }, "Set CAN_D1_UC_SRV_BM to 5, as exported."],
    [{ result: "throw_too_small", held_deg: 18 }, "SERVO3_MAX acts as 1550; exported as 1570."],
    [
      { result: "throw_too_large", positive_deg: -36, held_deg: -45 },
      "SERVO3_MIN acts as 1375; exported as 1400.",
    ],
    [{ result: "throw_too_small", held_deg: 3.6 }, "SERVO3_TRIM acts as 1510; exported as 1500."],
    [{ result: "wrong_type" }, "Not sent as UNITLESS. Clear bit 4 (PWM) of CAN_D1_UC_OPTION."],
  ] as const)("of ArduPilot: %o", (change, cause) => {
    expect(causeOf("ardupilot", row(3, change), list)).toBe(cause);
  });

  test.each([
    [{ result: "reversed", held_deg: -36 }, "Set UAVCAN_SV_REV to 1, as exported."],
    [{ result: "missing" }, "Set UAVCAN_SV_FUNC3: the output has no function."],
    [{ result: "throw_too_small", held_deg: 18 }, "UAVCAN_SV_MAX3 acts as 550; exported as 570."],
  ] as const)("of PX4: %o", (change, cause) => {
    expect(causeOf("px4", row(3, change), [row(1, { positive_deg: -36 }), row(3)])).toBe(cause);
  });

  test("and the output that moved instead", () => {
    expect(causeOf("px4", row(3, { result: "swapped", swapped_with: 1 }), list)).toContain(
      "The control of output 3 moved output 1.",
    );
  });
});

test("angles are the numbers of each program", () => {
  expect([unitsOf("ardupilot", 144), unitsOf("px4", -180)]).toEqual([1900, 0]);
});

test("scales hold all ends and all that was seen", () => {
  expect(halfRange([row(1)])).toBe(45);
  expect(halfRange([row(1), row(2, { seen_high_deg: 144 })])).toBe(150);
  expect(halfRange([row(1, { seen_low_deg: -180 })])).toBe(180);
});
