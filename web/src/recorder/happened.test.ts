import { describe, expect, test } from "vitest";
import { recordingOf } from "./happened";

const recording = (name: string, started_at: number, seconds: number, ...marks: number[]) => ({
  name,
  started_at,
  seconds,
  marks: marks.map(at => ({ at, reason: "stop" as const, text: "", params: {}, uid: null })),
});
const recordings = [recording("later", 1000, 40, 1030), recording("earlier", 900, 60, 930, 950)];

describe("the recording of something that happened", () => {
  test("is the one marked for it, at its mark", () => {
    expect(recordingOf({ from: 1030, to: 1030 }, recordings)).toEqual({ name: "later", at: 1030 });
    expect(recordingOf({ from: 949, to: 949.5 }, recordings)).toEqual({ name: "earlier", at: 950 });
  });

  test("is the newest that holds any of it, where none is marked for it", () => {
    expect(recordingOf({ from: 1010, to: 1015 }, recordings)).toEqual({ name: "later", at: 1010 });
    expect(recordingOf({ from: 800, to: 905 }, recordings)).toEqual({ name: "earlier", at: 900 });
  });

  test("of what was so all the time is a marked one", () => {
    expect(recordingOf({ from: 800, to: 940 }, recordings)).toEqual({ name: "earlier", at: 930 });
  });

  test("is none where none holds it, nor one that cannot be read", () => {
    const broken = { name: "broken", started_at: null, seconds: null, marks: [] };
    expect(recordingOf({ from: 700, to: 800 }, [...recordings, broken])).toBeNull();
    expect(recordingOf({ from: 2000, to: 2001 }, recordings)).toBeNull();
  });
});
