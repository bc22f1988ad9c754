/** Frequency responses: which one belongs to a run, what is drawn, and where nothing can be said. */
import { describe, expect, test } from "vitest";
import type { FrequencyCurve, FrequencyResponse, StepRun } from "../api/lab-types";
import {
  decadeTicks,
  type FrequencySentences,
  frequencyPictures,
  mainCurve,
  responsesOf,
  unreliable,
} from "./frequency";

const curve = (reliable: readonly boolean[], amplitude_deg = 2): FrequencyCurve =>
  ({
    amplitude_deg,
    frequency_hz: [1, 2, 5, 10, 20, 50],
    gain_db: [0, 0, 1, 12, -3, -20],
    phase_deg: [-5, -10, -30, -90, -170, -250],
    coherence: [1, 1, 1, 1, 0.95, 0.3],
    reliable: [...reliable],
    metrics: {
      bandwidth_3db_hz: { value: 20, low: 19, high: 21 },
      peak_db: { value: 12, low: 11, high: 13 },
      peak_hz: 10,
    },
  }) as unknown as FrequencyCurve;

const response = (id: number, p: number, curves: FrequencyCurve[]): FrequencyResponse =>
  ({ id, parameters: { angle_p_gain: p }, set_up: {}, curves }) as unknown as FrequencyResponse;

const run = (p: number): StepRun => ({ parameters: { angle_p_gain: p }, set_up: {} }) as unknown as StepRun;

const RELIABLE = [true, true, true, true, true, false];

const say: FrequencySentences = {
  name: one => one.letter ?? "-",
  peak: (db, hz) => `${db} at ${hz}`,
  bandwidth: (letter, hz) => `${letter} ${hz}`,
  notReliable: "not reliable",
  gain: "Gain",
  phase: "Phase",
  coherence: "Coherence",
  threshold: "0.9",
};

describe("the responses beside runs", () => {
  const calm = response(1, 40, []);
  const wild = response(2, 55, []);

  test("are those with the same gains, with the letter and colour of their run", () => {
    const shown = responsesOf([run(40), run(55)], [wild, calm]);
    expect(shown.map(one => [one.response.id, one.letter, one.place])).toEqual([
      [1, "A", 0],
      [2, "B", 1],
    ]);
  });

  test("include the newest, without a letter, if it belongs to no shown run", () => {
    const shown = responsesOf([run(40)], [wild, calm]);
    expect(shown.map(one => [one.response.id, one.letter, one.place])).toEqual([
      [1, "A", 0],
      [2, null, 1],
    ]);
  });

  test("are drawn once where two runs have the same gains", () => {
    expect(responsesOf([run(40), run(40)], [calm]).map(one => one.letter)).toEqual(["A"]);
  });

  test("of another set-up belong to no run", () => {
    const loaded = { ...calm, set_up: { mass_g: 100 } } as unknown as FrequencyResponse;
    expect(responsesOf([run(40)], [loaded]).map(one => one.letter)).toEqual([null]);
  });
});

describe("where nothing can be said", () => {
  test("is above the last reliable frequency of any curve", () => {
    const other = [true, true, true, false, false, false];
    expect(unreliable([curve(other), curve(RELIABLE)])).toEqual([
      { from: Math.log10(20), to: Math.log10(50) },
    ]);
  });

  test("is below the first one, too", () => {
    expect(unreliable([curve([false, true, true, true, true, true])])).toEqual([
      { from: 0, to: Math.log10(2) },
    ]);
  });

  test("is everywhere if nothing is reliable, and nowhere if all is", () => {
    expect(unreliable([curve([false, false, false, false, false, false])])).toEqual([
      { from: 0, to: Math.log10(50) },
    ]);
    expect(unreliable([curve([true, true, true, true, true, true])])).toEqual([]);
    expect(unreliable([])).toEqual([]);
  });
});

describe("the pictures", () => {
  const shown = responsesOf([run(40)], [response(1, 40, [curve(RELIABLE)])]);

  test("draw gain and phase where they are reliable only, and coherence everywhere", () => {
    const { gain, phase, coherence } = frequencyPictures(shown, say);
    for (const picture of [gain, phase]) {
      const { v } = picture.curves[0]?.samples(0) ?? { v: new Float64Array() };
      expect([...v].map(Number.isNaN)).toEqual(RELIABLE.map(one => !one));
      expect(picture.curves[0]?.open).toBe(true);
      expect(picture.hatched).toHaveLength(1);
    }
    expect([...(coherence.curves[0]?.samples(0).v ?? [])]).toEqual([1, 1, 1, 1, 0.95, 0.3]);
  });

  test("name the peak and the bandwidth", () => {
    const { gain } = frequencyPictures(shown, say);
    expect(gain.callouts).toMatchObject([{ t: 1, v: 12, word: "12 at 10" }]);
    expect(gain.feet).toEqual([{ t: Math.log10(20), word: "A 20" }]);
  });

  test("show the other amplitudes of a ladder only while one response is shown", () => {
    const ladder = response(1, 40, [curve(RELIABLE, 1), curve(RELIABLE, 2), curve(RELIABLE, 4)]);
    expect(mainCurve(ladder)?.amplitude_deg).toBe(2);
    expect(frequencyPictures(responsesOf([], [ladder]), say).gain.curves).toHaveLength(3);
    const two = responsesOf([run(40), run(55)], [ladder, response(2, 55, [curve(RELIABLE)])]);
    expect(frequencyPictures(two, say).gain.curves).toHaveLength(2);
  });
});

test("round frequencies are 1, 2 and 5 of each decade", () => {
  expect(decadeTicks(Math.log10(0.5), Math.log10(20)).map(at => Math.round(10 ** at * 10) / 10)).toEqual([
    0.5, 1, 2, 5, 10, 20,
  ]);
});
