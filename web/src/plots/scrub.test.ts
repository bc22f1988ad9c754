/** A recording looked at: what was the case at a time, never between samples; the way from sample to sample; playing. */
import { describe, expect, test } from "vitest";
import type { RecordingContent } from "../api/lab-types";
import { heldAt, poseAt, Scrub, scrubOf, seriesOf, trackOf, tracksOf } from "./scrub";

const column = (t: readonly number[], v: readonly number[]) => ({
  t: Float64Array.from(t),
  v: Float64Array.from(v),
});
const extent = { from: 0, to: 10, start: 0, origin: 0, utc: 1000 };

describe("what was the case", () => {
  const some = column([1, 1.1, 1.2, 1.3], [10, 20, 30, 40]);

  test("is the last sample, never a value between two", () => {
    expect(heldAt(some, 1.1)).toEqual({ value: 20, stale: false });
    expect(heldAt(some, 1.199)).toEqual({ value: 20, stale: false });
    expect(heldAt(some, 1.2)).toEqual({ value: 30, stale: false });
  });

  test("is not known before the first sample, nor without any", () => {
    expect(heldAt(some, 0.999)).toBeNull();
    expect(heldAt(column([], []), 5)).toBeNull();
  });

  test("is old in a gap and after the end, and stays what it was", () => {
    const gap = column([0, 0.1, 0.2, 3, 3.1], [1, 2, 3, 4, 5]);
    expect(heldAt(gap, 0.4)).toEqual({ value: 3, stale: false });
    expect(heldAt(gap, 2)).toEqual({ value: 3, stale: true });
    expect(heldAt(gap, 3)).toEqual({ value: 4, stale: false });
    expect(heldAt(gap, 60)).toEqual({ value: 5, stale: true });
  });

  test("is old where a sample is known to be missing", () => {
    expect(heldAt(column([0, 0.1], [7, Number.NaN]), 0.1)).toEqual({ value: 7, stale: true });
    expect(heldAt(column([0], [Number.NaN]), 0)).toBeNull();
  });

  test("of slow samples is fresh until the next one is due", () => {
    const slow = column([0, 1, 2, 3], [1, 2, 3, 4]);
    expect(heldAt(slow, 1.9)).toEqual({ value: 2, stale: false });
  });
});

describe("a pose", () => {
  const track = trackOf("a", "Rudder", "BLA15", row =>
    row === "current_angle"
      ? column([1, 2], [5, 6])
      : row === "command_angle"
        ? column([0], [30])
        : undefined,
  );

  test("has no angle and is stale before the first sample", () => {
    const expected = { uid: "a", series: "BLA15", angle: null, command: 30, limit_cw: null, limit_ccw: null };
    expect(poseAt(track, 0.5)).toEqual({ ...expected, stale: true });
  });

  test("holds the command as long as it was the last one", () => {
    expect(poseAt(track, 2)).toMatchObject({ angle: 6, command: 30, stale: false });
  });
});

describe("the way in time", () => {
  const track = trackOf("a", "", "", () => column([1, 2, 4], [1, 2, 3]));
  const at = (start: number) => new Scrub([track], { ...extent, start });

  test("goes from sample to sample, from between two to the next and the one before", () => {
    const scrub = at(0);
    const been = [1, 1, 1, 1, -1].map(places => {
      scrub.step(places);
      return scrub.at.value;
    });
    expect(been).toEqual([1, 2, 4, 4, 2]);
    scrub.seek(3);
    scrub.step(-1);
    expect(scrub.at.value).toBe(2);
    scrub.seek(3);
    scrub.step(1);
    expect(scrub.at.value).toBe(4);
  });

  test("never leaves the recording", () => {
    const scrub = at(-99);
    expect(scrub.at.value).toBe(0);
    scrub.seek(99);
    expect(scrub.at.value).toBe(10);
    scrub.seek(Number.NaN);
    expect(scrub.at.value).toBe(10);
  });

  test("plays at the selected speed, stops at the end, and restarts from there", () => {
    const scrub = at(9);
    scrub.pass(0.5);
    expect(scrub.at.value, "it does not play").toBe(9);
    scrub.speed.value = 0.25;
    scrub.play();
    scrub.pass(0.4);
    expect(scrub.at.value).toBeCloseTo(9.1, 9);
    scrub.speed.value = 4;
    scrub.pass(0.5);
    expect([scrub.at.value, scrub.playing.value]).toEqual([10, false]);
    scrub.play();
    expect([scrub.at.value, scrub.playing.value]).toEqual([0, true]);
    scrub.speed.value = 1;
    scrub.pass(3600);
    expect(scrub.at.value, "a tab that slept goes on where it was").toBe(1);
  });

  test("steps through any samples when no servo has an angle", () => {
    const scrub = new Scrub([], extent, null, column([3, 5], [0, 0]));
    scrub.step(1);
    expect([scrub.at.value, scrub.poses.value, scrub.track]).toEqual([3, [], undefined]);
  });
});

test("a recording has every servo it knows, its model, and limits that were read before it begins", () => {
  const servo = (uid: string, model_number: number | null, at: number) => ({
    uid,
    title: uid.toUpperCase(),
    model_number,
    readings: { angle_limit_cw: { value: 60, at }, current_angle: { value: 1, at } },
  });
  const content = {
    about: { servos: [servo("a", 62, 900), servo("b", null, 1005)] },
    telemetry: [{ uid: "a", channel: "current_angle", t: [1001, 1001.1], v: [12, null] }],
  } as unknown as RecordingContent;
  const scrub = scrubOf(content, { zero: 1002, from: -2, to: 8 }, "b");
  expect(scrub.tracks.map(one => [one.uid, one.name, one.series])).toEqual([
    ["a", "A", "BLA15"],
    ["b", "B", ""],
  ]);
  expect([scrub.front.value, scrub.at.value, scrub.extent.utc]).toEqual(["b", 0, 1002]);
  scrub.seek(-1);
  expect(scrub.poses.value[0]).toMatchObject({ angle: 12, limit_cw: 60, stale: false });
  expect(scrub.poses.value[1]).toMatchObject({ angle: null, limit_cw: null, stale: true });
  scrub.seek(-1.5);
  expect(scrub.poses.value[0]?.angle, "what was read before the samples begin is no sample").toBeNull();
});

test("a file of columns is a servo each name, with a model where the file has it", () => {
  const file = (...heads: string[]) => heads.map(head => ({ head, ...column([0], [62]) }));
  const tracks = tracksOf(
    file("A/current_angle", "A/model_number", "B, or so/current_angle", "C/current_speed"),
  );
  expect(tracks.map(one => [one.name, one.series])).toEqual([
    ["A", "BLA15"],
    ["B, or so", ""],
  ]);
  expect(new Set(tracks.map(one => one.uid)).size).toBe(2);
  expect(tracks.every(one => /^[0-9a-f]{32}$/.test(one.uid))).toBe(true);
  expect(tracksOf(file("current_angle"))[0]?.name).toBe("");
  expect(tracksOf(file("current_speed"))).toEqual([]);
});

test("a series is what 0x50 reads", () => {
  expect([61, 62, 86, 63, null, undefined].map(seriesOf)).toEqual(["BLA21", "BLA15", "BLA34", "", "", ""]);
});
