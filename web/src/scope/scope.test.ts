/** The scope's arithmetic: trigger, statistics, spectrum, layouts; many cases each from a seeded generator. */
import { describe, expect, test } from "vitest";
import type { StepRun } from "../api/lab-types";
import { TimeSpan } from "../plots/span";
import { readChannels, readLayouts, USUAL_RULE, writeChannels } from "./layout";
import { overlayCurve, overlayOfRun, type ScopeOverlay } from "./overlay";
import { fft, highestPeak, spectrumOf } from "./spectrum";
import { statisticsOf } from "./statistics";
import { type Acquisition, crossing, step, windowOf } from "./trigger";

function random(seed: number): () => number {
  let x = seed;
  return () => {
    x = (x * 1_664_525 + 1_013_904_223) % 4_294_967_296;
    return x / 4_294_967_296;
  };
}
const sampled = (count: number, hz: number, f: (t: number) => number) => {
  const t = Float64Array.from({ length: count }, (_, i) => 100 + i / hz);
  return { t, v: t.map(f) };
};
const CASES = Array.from({ length: 40 }, (_, i) => i + 1);

describe("trigger", () => {
  test.each(CASES)("a crossing lies between samples on either side of the level (%i)", seed => {
    const next = random(seed);
    const one = sampled(200, 50, () => next() * 20 - 10);
    const rule = { ...USUAL_RULE, level: next() * 10 - 5, edge: "rising" as const };
    let after = 0;
    for (let at = crossing(one, rule, after); at !== null; at = crossing(one, rule, after)) {
      expect(at).toBeGreaterThan(after);
      const right = one.t.findIndex(t => t >= (at ?? 0) - 1e-9);
      expect(one.v[right - 1]).toBeLessThan(rule.level);
      expect(one.v[right]).toBeGreaterThanOrEqual(rule.level);
      after = at;
    }
  });

  test("edges, a level that is only touched, gaps, and commands that step", () => {
    const one = { t: Float64Array.of(0, 1, 2, 3, 4, 5), v: Float64Array.of(0, 2, 0, Number.NaN, 2, 2) };
    const at = (edge: "rising" | "falling" | "either", after = -1) =>
      crossing(one, { ...USUAL_RULE, level: 1, edge }, after);
    expect(at("rising")).toBe(0.5);
    expect(at("falling")).toBe(1.5);
    expect(at("either", 0.5)).toBe(1.5);
    expect(at("rising", 1.5)).toBeNull();
    expect(crossing(one, { ...USUAL_RULE, level: 1 }, -1, true)).toBe(1);
    expect(crossing(one, { ...USUAL_RULE, level: 2 }, 2)).toBeNull();
  });

  test("waits, fills, holds a single capture, and rearms in Run after the holdoff", () => {
    const rule = { ...USUAL_RULE, before: 0.25, holdoff: 3 };
    const fired = (after: number) => [11, 12, 20].find(one => one > after) ?? null;
    const go = (from: Acquisition, now: number, mode: "run" | "single" | "pause") =>
      step(from, now, mode, rule, 2, fired);
    let now: Acquisition = go({ state: "free" }, 10, "single");
    expect(now).toEqual({ state: "waiting", since: 10 });
    now = go(now, 11.1, "single");
    expect(now).toEqual({ state: "filling", at: 11 });
    expect(go(now, 12.4, "single")).toEqual(now);
    now = go(now, 12.5, "single");
    expect(now).toEqual({ state: "triggered", at: 11 });
    expect(go(now, 99, "single")).toEqual(now);
    expect(go(now, 13.9, "run")).toEqual(now);
    expect(go(now, 21, "run")).toEqual({ state: "filling", at: 20 });
    expect(go(now, 21, "pause")).toEqual({ state: "paused" });
    expect(windowOf(11, rule, 2)).toEqual({ from: 10.5, to: 12.5, zero: 11 });
  });
});

describe("statistics", () => {
  test.each(CASES)("agree with the plain sums, in either order of the cursors, far from zero (%i)", seed => {
    const next = random(seed);
    const one = sampled(120, 60, () => 1e6 + next());
    const values = [...one.v];
    const mean = values.reduce((sum, v) => sum + v - 1e6, 0) / values.length + 1e6;
    const sd = Math.sqrt(values.reduce((sum, v) => sum + (v - mean) ** 2, 0) / (values.length - 1));
    const found = statisticsOf(one, 200, 0);
    expect(found).toEqual(statisticsOf(one, 0, 200));
    expect(found?.count).toBe(120);
    expect(found?.mean).toBeCloseTo(mean, 6);
    expect(found?.sd).toBeCloseTo(sd, 6);
    expect(found?.peakToPeak).toBeCloseTo(Math.max(...values) - Math.min(...values), 9);
    expect(found?.missing).toBe(0);
  });

  test("say how many samples are missing, and nothing of nothing", () => {
    const one = sampled(50, 10, () => 1);
    const holed = { t: one.t.filter((_, i) => i < 20 || i > 29), v: new Float64Array(40).fill(1) };
    expect(statisticsOf(holed, 0, 200)?.missing).toBe(10);
    expect(statisticsOf(one, 0, 1)).toBeNull();
  });
});

describe("spectrum", () => {
  test.each(CASES)("the sum of squares stays through the FFT (%i)", seed => {
    const next = random(seed);
    const n = 2 ** (3 + (seed % 6));
    const re = Float64Array.from({ length: n }, () => next() - 0.5);
    const im = Float64Array.from({ length: n }, () => next() - 0.5);
    const power = () => re.reduce((sum, x, i) => sum + x * x + (im[i] ?? 0) ** 2, 0);
    const before = power();
    fft(re, im);
    expect(power() / n).toBeCloseTo(before, 9);
  });

  test.each(CASES)("a sine is found with its frequency and amplitude, whatever its mean (%i)", seed => {
    const next = random(seed);
    const hz = 3 + next() * 30;
    const amplitude = 0.2 + next() * 5;
    const one = sampled(500, 125, t => 40 + amplitude * Math.sin(2 * Math.PI * hz * t + seed));
    const spectrum = spectrumOf(one, 100, 100 + 499 / 125);
    const peak = spectrum && highestPeak(spectrum);
    expect(Math.abs((peak?.hz ?? 0) - hz)).toBeLessThan((spectrum?.resolution ?? 0) / 5);
    expect((peak?.amplitude ?? 0) / amplitude).toBeGreaterThan(0.7);
    expect((peak?.amplitude ?? 0) / amplitude).toBeLessThan(1.05);
    expect(spectrum?.resolution).toBeCloseTo(0.25, 2);
  });

  test("says nothing across a gap or of a few samples", () => {
    const one = sampled(200, 50, Math.sin);
    one.v[77] = Number.NaN;
    expect(spectrumOf(one, 100, 104)).toBeNull();
    expect(spectrumOf(sampled(10, 50, Math.sin), 100, 101)).toBeNull();
  });
});

describe("layouts", () => {
  const uid = "0123456789abcdef0123456789abcdef";
  test("channels survive the address; what is none is left out", () => {
    const channels = [
      { uid, channel: "current_angle" },
      { uid, channel: "command_angle" },
    ];
    expect(readChannels(writeChannels(channels))).toEqual(channels);
    expect(readChannels(`x:current_angle;${uid}:<b>,current_angle,current_angle;;`)).toEqual([channels[0]]);
  });

  test("what storage holds is read, and anything else is no layout", () => {
    const layout = {
      channels: [{ uid, channel: "current_angle" }],
      source: null,
      rule: USUAL_RULE,
      seconds: 2,
    };
    expect(readLayouts(JSON.parse(JSON.stringify([{ name: "A", layout }])))).toEqual([{ name: "A", layout }]);
    for (const odd of [null, 3, "x", {}, [null], [{ name: "", layout }], [{ name: "B", layout: {} }]]) {
      expect(readLayouts(odd)).toEqual([]);
    }
    const strange = { ...layout, source: "gone", rule: { level: "high", before: 7 }, seconds: -1 };
    expect(readLayouts([{ name: "C", layout: strange }])[0]?.layout).toEqual({
      ...layout,
      seconds: 10,
      rule: { ...USUAL_RULE, before: 1 },
    });
  });
});

test("a run is laid over its own servo's curves, its command at the instant of the trigger", () => {
  const step = { t: [-0.1, 0, 0.2], angle_deg: [0, 0, 9.5], from_deg: 0, to_deg: 10, direction: "there" };
  const laid = overlayOfRun({ steps: [step] } as unknown as StepRun, "Run 1", "Left") as ScopeOverlay;
  const held = new TimeSpan(() => 100);
  held.still.value = { from: 49, to: 51, zero: 50 };
  const curve = (name: string, channel: string) => {
    const drawn = { uid: "u", channel, name, colour: 0, dashed: false, unit: "°", decimals: 1 };
    return overlayCurve(laid, drawn, held)?.samples?.(0);
  };
  expect(Array.from(curve("Left", "current_angle")?.t ?? [])).toEqual([49.9, 50, 50.2]);
  expect(Array.from(curve("Left", "command_angle")?.v ?? [])).toEqual([0, 0, 10, 10]);
  expect(curve("Right", "current_angle")).toBeUndefined();
  expect(overlayOfRun({ steps: [] } as unknown as StepRun, "Run 2", "Left")).toBeNull();
});
