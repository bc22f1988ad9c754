/** The command in force: an angle, a speed or a torque, the same wherever it is shown. */
import { afterEach, beforeEach, expect, test } from "vitest";
import type { Reading, Servo } from "../api/types";
import { telemetry } from "../telemetry/store";
import { commandNow, driveText } from "./activity";
import { monotonic, now } from "./clock";
import { replaceAll } from "./fleet";
import { held } from "./hold-to-run";
import { link } from "./link";
import { motion } from "./motion";
import { sheetOf } from "./parameters";

const UID = "3".repeat(32);

const read = (key: string, value: number | null) =>
  sheetOf(UID).put({ key, value, configured: value, raw: value, age_s: 0.2 } as unknown as Reading);

beforeEach(() => {
  link.value = { state: "up", since: 0 };
  telemetry.clear();
  replaceAll([
    { uid: UID, online: true, angle_deg: 0, age_s: 0, unsaved: [], uptime_s: 9 } as unknown as Servo,
  ]);
  now.value = monotonic();
  for (const kind of ["angle", "speed", "torque"]) read(`command_${kind}`, null);
});

afterEach(() => {
  held.value = null;
  motion.value = { phase: "off", why: null };
});

test("none is in force after a start", () => {
  expect(commandNow(UID)).toMatchObject({ kind: "none", figure: { stale: false } });
  link.value = { state: "down", since: 0 };
  expect(commandNow(UID).figure.stale, "without a link nothing is known").toBe(true);
});

test("an angle is", () => {
  read("command_angle", 12);
  expect(commandNow(UID)).toMatchObject({ kind: "angle", figure: { value: 12 } });
});

test("under speed control the speed is, not the angle of before", () => {
  read("command_speed", -20);
  expect(commandNow(UID)).toMatchObject({ kind: "speed", figure: { value: -20 } });
  expect(driveText("speed", -20)).toBe("\u221220\u202frpm");
});

test("what this page runs is in force from the press on, before the servo was read again", () => {
  read("command_angle", 0.3);
  motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
  held.value = { kind: "speed", value: 20 };
  expect(commandNow(UID)).toMatchObject({ kind: "speed", figure: { value: 20, stale: false } });
  held.value = null;
  expect(commandNow(UID)).toMatchObject({ kind: "angle", figure: { value: 0.3 } });
});
