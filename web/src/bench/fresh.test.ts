/** One definition of stale: the server's ages, the rate that was granted, and the link. */
import { afterEach, beforeEach, describe, expect, test } from "vitest";
import type { Reading, Servo } from "../api/types";
import { telemetry } from "../telemetry/store";
import { monotonic, now } from "./clock";
import { replaceAll, servo } from "./fleet";
import { angleNow, figureNow, freshAngle } from "./fresh";
import { link } from "./link";
import { sheetOf } from "./parameters";
import { staleAfter, takeStaleAfter } from "./staleness";
import { watched } from "./telemetry-subscription";

const UID = "4".repeat(32);
const usual = staleAfter.peek();

function received(age_s: number | null, more: Partial<Servo> = {}): void {
  replaceAll([
    { uid: UID, online: true, angle_deg: 12, age_s, unsaved: [], uptime_s: 9, ...more } as unknown as Servo,
  ]);
  now.value = monotonic();
}

beforeEach(() => {
  link.value = { state: "up", since: 0 };
  telemetry.clear();
});

afterEach(() => {
  staleAfter.value = usual;
  watched.value = null;
});

describe("the angle", () => {
  test.each([
    [0.1, false],
    [0.4, false],
    [0.6, true],
    [null, true],
  ])("of %s s is stale: %s", (age, stale) => {
    received(age);
    expect(angleNow(servo(UID))).toMatchObject({ value: 12, stale });
  });

  test("is stale by the server's figure, and by none of the page's", () => {
    received(0.9);
    takeStaleAfter({ angle: 1.2, command: 2.5, status: 5, faults: 2.5 });
    expect(angleNow(servo(UID)).stale).toBe(false);
  });

  test("is stale of a servo that is silent, and without a link", () => {
    received(0.1, { online: false });
    expect(angleNow(servo(UID)).stale).toBe(true);
    received(0.1);
    link.value = { state: "down", since: 0 };
    expect(angleNow(servo(UID)).stale).toBe(true);
    expect(freshAngle(servo(UID))).toBeNull();
  });

  test("is the same for all callers", () => {
    received(0.3);
    expect(figureNow(UID, "current_angle").stale).toBe(angleNow(servo(UID)).stale);
    expect(freshAngle(servo(UID))).toBe(12);
  });
});

describe("a figure that is polled", () => {
  const read = (age_s: number) =>
    sheetOf(UID).put({
      key: "current_voltage",
      value: 7.4,
      configured: 7.4,
      raw: 74,
      age_s,
    } as unknown as Reading);
  const volts = () => figureNow(UID, "current_voltage");

  test("may be as old as the server's poll makes it", () => {
    received(0.1);
    read(4);
    expect(volts()).toMatchObject({ value: 7.4, stale: false });
    read(6);
    expect(volts().stale).toBe(true);
  });

  test("is stale after two periods of the rate at which it is watched", () => {
    received(0.1);
    read(2);
    const grant = { uid: UID, channels: ["current_voltage"], granted_hz: 2 };
    watched.value = grant as unknown as typeof watched.value;
    expect(volts().stale).toBe(true);
    watched.value = { ...grant, granted_hz: 0.5 } as unknown as typeof watched.value;
    expect(volts().stale).toBe(false);
  });
});
