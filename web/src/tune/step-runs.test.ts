/** Step tests in words and numbers: medians, errors, differences, the way back. */
import { describe, expect, test } from "vitest";
import type { StepMetrics, StepRun } from "../api/lab-types";
import * as runs from "./step-runs";

const metrics = (more: Partial<StepMetrics> = {}): StepMetrics => ({
  sample_s: 0.004,
  delay_s: 0.016,
  rise_s: 0.09,
  crossing_s: 0.15,
  peak_deg: 10.2,
  overshoot_pct: 2,
  settling_s: 0.16,
  steady_state_error_deg: 0.1,
  peak_speed_rpm: 30,
  hunting: "none",
  hunting_rms_deg: 0.01,
  hunting_hz: 0,
  ...more,
});

const NOTHING: StepRun["set_up"] = {
  arm_mm: null,
  mass_g: null,
  inertia_gm2: null,
  load_nm: null,
  mounting: null,
  supply_v: null,
  ambient_c: null,
};

const run = (steps: Partial<StepMetrics>[], parameters: StepRun["parameters"] = {}): StepRun => ({
  id: 1,
  uid: "0".repeat(32),
  at: 0,
  note: "",
  procedure: "step/1",
  set_up: NOTHING,
  verdict: { level: "ok", code: "settles", text: "Good.", advice: null, params: {} },
  firmware: "1.300",
  model: "BLA21-06U-A0",
  voltage_v: 7.4,
  temperature_c: 25,
  parameters,
  warnings: [],
  step_deg: 10,
  band_deg: 0.5,
  achieved_hz: 300,
  steps: steps.map(one => ({
    direction: "there",
    from_deg: 0,
    to_deg: 10,
    t: [],
    angle_deg: [],
    metrics: metrics(one),
  })),
});

describe("choice of runs", () => {
  test("letters follow age, whatever was ticked first", () => {
    expect(runs.toggled([5], 3)).toEqual([3, 5]);
    expect(runs.toggled([3, 5], 5)).toEqual([3]);
    expect([0, 1, 7].map(runs.letter)).toEqual(["A", "B", "H"]);
  });

  test("the newest is shown first, beside the one before it if that can be compared", () => {
    const numbered = (id: number, more: Partial<StepRun> = {}) => ({ ...run([{}]), id, ...more });
    expect(runs.shownFirst([])).toEqual([]);
    expect(runs.shownFirst([numbered(9), numbered(7), numbered(3)])).toEqual([7, 9]);
    expect(runs.shownFirst([numbered(9, { set_up: { ...NOTHING, mass_g: 100 } }), numbered(7)])).toEqual([9]);
    expect(runs.shownFirst([numbered(9, { step_deg: 5 }), numbered(7)])).toEqual([9]);
  });

  test("a new run takes the place of B, and is added where more are overlaid", () => {
    expect(runs.withNewest([], 5)).toEqual([5]);
    expect(runs.withNewest([3], 5)).toEqual([3, 5]);
    expect(runs.withNewest([3, 4], 5)).toEqual([3, 5]);
    expect(runs.withNewest([2, 3, 4], 5)).toEqual([2, 3, 4, 5]);
  });

  test("a ninth makes the oldest leave", () => {
    expect(runs.toggled([1, 2, 3, 4, 5, 6, 7, 8], 9)).toEqual([2, 3, 4, 5, 6, 7, 8, 9]);
  });
});

describe("figures", () => {
  test("are medians with the range of the steps, and count those that got there", () => {
    const one = run([{ rise_s: 0.1 }, { rise_s: 0.2 }, { rise_s: 0.12 }, { rise_s: null }]);
    expect(runs.figure(one, "there", "rise_s")).toEqual({
      value: 0.12,
      low: 0.1,
      high: 0.2,
      reached: 3,
      of: 4,
    });
    expect(runs.figure(run([{ rise_s: 0.1 }, { rise_s: 0.2 }]), "there", "rise_s")?.value).toBeCloseTo(0.15);
    expect(runs.figure(run([{ rise_s: null }]), "there", "rise_s")).toBeNull();
    expect(runs.figure(one, "back", "rise_s")).toBeNull();
  });

  test("the error of a run is its widest gap", () => {
    expect(runs.sampleOf(run([{ sample_s: 0.004 }, { sample_s: 0.013 }]), "there")).toBe(0.013);
  });

  test("a difference smaller than the errors of both is marked", () => {
    const base = runs.figure(run([{ rise_s: 0.1 }]), "there", "rise_s");
    const other = runs.figure(run([{ rise_s: 0.105 }]), "there", "rise_s");
    expect(runs.compared(base, other, "time", 0.008)?.within).toBe(true);
    expect(runs.compared(base, other, "time", 0.004)?.within).toBe(false);
    expect(runs.compared(base, null, "time", 0.004)).toBeNull();
  });

  test("hunting is the worst of the steps", () => {
    const one = run([{}, { hunting: "hunting", hunting_hz: 9 }, { hunting: "slight", hunting_hz: 2 }]);
    expect(runs.hunting(one, "there")).toMatchObject({ hunting: "hunting", hunting_hz: 9 });
  });
});

describe("the way back", () => {
  const before = run([{}], { angle_p_gain: 40, smoothing: false, angle_boost: null, angle_limit_cw: 60 });

  test("is what the servo holds otherwise, of the gains alone", () => {
    const held: Record<string, number | boolean> = { angle_p_gain: 80, smoothing: false, angle_limit_cw: 30 };
    expect([...runs.gainsToRestore(before, key => held[key])]).toEqual([["angle_p_gain", 40]]);
  });

  test("leaves alone what is not known now", () => {
    expect(runs.gainsToRestore(before, () => undefined).size).toBe(0);
  });

  test("differences name the gains first", () => {
    expect(
      runs.differing({ torque_limit_cw: [1, 2], angle_dead_band: [1, 2], angle_p_gain: [1, 2] }),
    ).toEqual(["angle_p_gain", "angle_dead_band", "torque_limit_cw"]);
  });
});

test("a warning of several runs is listed once, with their letters", () => {
  const odd = (line: string) => ({
    ...run([{}]),
    warnings: [{ text: line, code: "text" as const, params: {} }],
  });
  expect(runs.warned([odd("x"), run([{}]), odd("y"), odd("x")])).toEqual([
    { line: "x", letters: ["A", "D"] },
    { line: "y", letters: ["C"] },
  ]);
});

test("a warning that the verdict says already is not repeated", () => {
  const smoothed = {
    ...run([{}]),
    warnings: [{ text: "Smoothing is on.", code: "smoothing_on" as const, params: {} }],
  };
  expect(runs.warned([smoothed])).toHaveLength(1);
  const verdict = { ...smoothed.verdict, code: "smoothing_measured" as const };
  expect(runs.warned([{ ...smoothed, verdict }])).toEqual([]);
});

describe("the path", () => {
  test("says which limit a step would cross", () => {
    const limits = { cw: 60, ccw: -60 };
    expect(runs.hornPathOf(0.3, 10, limits)).toEqual({ from: 0.3, to: 10.3, outside: null });
    expect(runs.hornPathOf(55, 10, limits).outside).toBe("cw");
    expect(runs.hornPathOf(-55, -10, limits).outside).toBe("ccw");
    expect(runs.hornPathOf(55, 10, null).outside).toBeNull();
    expect(runs.testDuration(2, 1.5)).toBe(6);
  });
});
