/** Every state a row can be in, and which one wins. */
import { describe, expect, test } from "vitest";
import type { Row } from "../api/types";
import { scaleOf } from "../change/scale";
import { predict } from "../parameters/prediction";
import { text } from "../text";
import type { KnownReading } from "./parameters";
import { type RowFacts, spanOf, viewOf } from "./row-state";

const row = {
  key: "speed_limit_cw",
  address: 0x3a,
  name: "0x3A",
  group: "limit",
  label: "Speed limit CW",
  section: "4.32",
  access: "rw",
  kind: "number",
  unit: "rpm",
  per_unit: 1,
  choices: [],
} as unknown as Row;

const reading: KnownReading = {
  key: row.key,
  address: row.address,
  value: 300,
  configured: 300,
  ram: 300,
  raw: 300,
  unit: "rpm",
  at: 0,
  age_s: 0,
  rom: 300,
  default: 300,
  minimum: 0,
  maximum: 300,
  in_effect: true,
  why_not: null,
  why: null,
  stale: false,
  differs_from_default: false,
  unsaved: false,
  readAt: 10,
};

const facts = (more: Partial<RowFacts> = {}): RowFacts => ({
  row,
  reading,
  draft: undefined,
  outcome: undefined,
  unsaved: false,
  reachable: true,
  now: () => 24,
  ...more,
});

const staged = { text: "200", verdict: { ok: true, value: 200 } } as const;
const above = {
  text: "400",
  verdict: { ok: false, code: "above", what: "", remedy: "", nearest: 300 },
} as const;

describe("viewOf", () => {
  test.each<[string, Partial<RowFacts>, string]>([
    ["nothing to say", {}, "idle"],
    ["staged", { draft: staged }, "staged"],
    ["typed back to what RAM holds", { draft: { text: "300", verdict: { ok: true, value: 300 } } }, "idle"],
    ["above the range", { draft: above, outcome: { kind: "failed", what: "", rest: "" } }, "out_of_range"],
    ["no number", { draft: { text: "x", verdict: { ...above.verdict, code: "not_a_number" } } }, "invalid"],
    ["writing", { draft: staged, outcome: { kind: "pending" } }, "pending"],
    ["not written", { draft: staged, outcome: { kind: "failed", what: "", rest: "" } }, "failed"],
    ["clamped", { outcome: { kind: "clamped", requested: 290 }, unsaved: true }, "clamped"],
    ["in RAM only", { unsaved: true }, "applied"],
    ["saved", { outcome: { kind: "saved", at: 0 } }, "saved"],
    [
      "no effect",
      { reading: { ...reading, in_effect: false, why_not: "No effect now: off (0x25)." } },
      "no_effect",
    ],
    ["effect not known", { reading: { ...reading, in_effect: null } }, "idle"],
    ["stale", { reading: { ...reading, stale: true } }, "stale"],
    ["no link", { reachable: false }, "stale"],
    ["never read", { reading: { ...reading, raw: null, value: null } }, "stale"],
    ["not received", { reading: undefined }, "stale"],
  ])("%s", (_, more, state) => expect(viewOf(facts(more)).state).toBe(state));

  test("no effect leads to the register that is to blame, never to itself", () => {
    const why_not = "No effect now: speed and torque control (0x25) is off.";
    const view = viewOf(facts({ reading: { ...reading, in_effect: false, why_not } }));
    expect(view).toMatchObject({ goTo: "0x25", words: "No effect now: 0x25 is off." });
    const own = "No effect now: 0x3A does nothing.";
    expect(viewOf(facts({ reading: { ...reading, in_effect: false, why_not: own } })).goTo).toBeNull();
  });

  test("the reason is said in the language of the page, by its code", () => {
    const why = { code: "off_now", params: { last_command: "speed" } };
    Object.assign(text.table.why, { off_now: "after {last_command}" });
    Object.assign(text.table.commands, { speed: "Drehzahl" });
    expect(viewOf(facts({ reading: { ...reading, in_effect: false, why } })).words).toContain(
      "after Drehzahl",
    );
  });

  test("an old value says how old", () => {
    expect(viewOf(facts({ reachable: false })).words).toBe("Last read 14\u202fs ago");
  });
});

describe("spanOf", () => {
  test("a unit that follows another row brings its scale along", () => {
    const either = {
      ...row,
      unit: "°",
      per_unit: 10,
      unit_when: { parameter: "pwm_mode", raw: 1, unit: "rpm", per_unit: 1 },
    } as Row;
    expect(spanOf(either, { ...reading, unit: "°" }).perUnit).toBe(10);
    expect(spanOf(either, { ...reading, unit: "rpm" }).perUnit).toBe(1);
  });
});

describe("predict", () => {
  const will = (torque: unknown, soft: unknown) =>
    predict(key => (key === "torque_mode" ? torque : soft) as never);
  test.each([
    ["on", true, "soft_start"],
    ["on", false, "hold"],
    ["off", true, "off"],
    ["brake", true, "brake"],
    [undefined, true, "unknown"],
    ["on", undefined, "unknown"],
  ])("torque %s, soft start %s: %s", (torque, soft, what) => expect(will(torque, soft)).toBe(what));
});

describe("scaleOf", () => {
  const wide = { unit: "°", perUnit: 10, minimum: 0, maximum: 36_000_000 };
  test("an unused range is drawn only as far as it is used", () => {
    expect(scaleOf(wide, [90, null])).toEqual({ low: 0, high: 180 });
    expect(scaleOf(wide, [90, 720])).toEqual({ low: 0, high: 720 });
  });
  test("other ranges are the model's own", () => {
    expect(scaleOf({ unit: "rpm", perUnit: 1, minimum: 0, maximum: 300 }, [20])).toEqual({
      low: 0,
      high: 300,
    });
    expect(scaleOf({ unit: "rpm", perUnit: 1, minimum: null, maximum: null }, [20])).toBeNull();
  });
});
