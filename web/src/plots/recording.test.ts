/** Recordings: the time line from the first mark, panels worth a plot, whose they are. */
import { describe, expect, test } from "vitest";
import type { RecordingColumns, RecordingContent } from "../api/lab-types";
import { alsoMarked, firstServo, isZip, panelsOf, timelineOf, timelineTicksOf } from "./recording";

const column = (uid: string, channel: string, n: number): RecordingColumns => ({
  uid,
  channel,
  t: Array.from({ length: n }, (_, i) => i),
  v: Array.from({ length: n }, () => 1),
});

describe("the time line", () => {
  test("is counted from the first mark", () => {
    const line = timelineOf({ started_at: 1000, ended_at: 1070, marks: [{ at: 1060 }, { at: 1065 }] });
    expect(line).toEqual({ zero: 1060, from: -60, to: 10 });
    expect(timelineTicksOf(line, 8)).toEqual([-60, -50, -40, -30, -20, -10, 0, 10]);
  });

  test("has room even for a recording of no length", () => {
    const line = timelineOf({ started_at: 1000, ended_at: 1000, marks: [] });
    expect(line).toEqual({ zero: 1000, from: 0, to: 1 });
    expect(timelineTicksOf(line, 8)).toEqual([0, 1]);
  });
});

describe("panels", () => {
  test("put a command with what it commands, and leave out what was read once", () => {
    const panels = panelsOf(
      [
        column("a", "current_voltage", 5),
        column("a", "command_angle", 5),
        column("a", "current_angle", 50),
        column("a", "servo_id", 1),
        column("a", "command_speed", 9),
        column("b", "current_angle", 50),
      ],
      "a",
    );
    expect(panels.map(one => one.key)).toEqual(["current_angle", "current_voltage", "current_speed"]);
    expect(panels[0]?.command?.channel).toBe("command_angle");
    expect(panels[2]?.measured).toBeNull();
  });

  test("leave out a command that was never given", () => {
    const never = { ...column("a", "command_torque", 9), v: new Array<null>(9).fill(null) };
    expect(panelsOf([never, column("a", "current_torque", 1)], "a")).toEqual([]);
  });
});

test("the servo of a mark is shown first, unless the recording does not know it", () => {
  const content = (uid: string | null) =>
    ({
      about: { marks: [{ uid: null }, { uid }], servos: [{ uid: "a" }, { uid: "b" }] },
      telemetry: [column("a", "current_angle", 2)],
    }) as unknown as RecordingContent;
  expect(firstServo(content("b"))).toBe("b");
  expect(firstServo(content("c"))).toBe("a");
  expect(firstServo(content(null))).toBe("a");
});

test("other marks are listed once", () => {
  const marks = ["a went silent", "rattled", "rattled"].map(text => ({
    at: 0,
    reason: "manual" as const,
    text,
    params: {},
    uid: null,
  }));
  expect(alsoMarked({ text: "a went silent", marks })).toEqual(["rattled"]);
});

test("a recording is a .zip", () => {
  expect([isZip("a.ZIP"), isZip("a.log")]).toEqual([true, false]);
});
