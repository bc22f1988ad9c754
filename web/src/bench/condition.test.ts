/** What is said of a servo's health, and what outranks what. */
import { describe, expect, test } from "vitest";
import type { Servo, Stop } from "../api/types";
import { type ConditionFacts, conditionOf, needsAttention } from "./condition";
import type { KnownServo } from "./fleet";

const servo = (more: Partial<KnownServo> = {}): KnownServo => ({
  uid: "a".repeat(32),
  node_id: 11,
  servo_id: 1,
  label: "Gripper",
  name: "",
  model: "BLA21-06U-A0",
  series: "BLA21",
  pwm: false,
  firmware: "1.300",
  hardware_version: 6010,
  serial: "61-000001",
  production_date: null,
  model_number: 61,
  known_model: true,
  treated_as: { model: null, firmware: null },
  firmware_note: null,
  online: true,
  state: "ready",
  health: "ok",
  mode: "operational",
  uptime_s: 1,
  angle_deg: 0,
  command_deg: null,
  age_s: 0,
  output: { state: "on", reason: "configured", by: null, since: null },
  activity: {
    state: "holding",
    since: 0,
    peak_to_peak_deg: 0,
    oscillation_hz: null,
    torque_pct: 0,
    torque_limit_pct: 100,
  },
  commanded_by: [],
  unsaved: [],
  unacknowledged: 0,
  drift: [],
  lost: [],
  owed: [],
  position_unit: {
    unit: "hundred_degrees",
    state: "confirmed",
    evidence: "",
    evidence_code: "unit_agreed" as const,
    evidence_params: {},
  },
  faults: { notification: 0, warning: 0, failure: 0 },
  bus: "can0",
  angleAt: 100,
  bootAt: null,
  ...more,
});

const faults: ConditionFacts["faults"] = [
  {
    level: "failure",
    bit: 1,
    key: "motor_signal",
    label: "Motor signal",
    advice: "Take it out of use and repair it.",
  },
  { level: "warning", bit: 4, key: "magnet_weak", label: "Weak sensor magnet", advice: "Plan a repair." },
  { level: "warning", bit: 8, key: "temperature_high", label: "Temperature high", advice: "Let it cool." },
  { level: "notification", bit: 8, key: "angle_limit_cw", label: "At CW angle limit", advice: "" },
];

const facts = (more: Partial<ConditionFacts> = {}): ConditionFacts => ({
  faults,
  temperature: null,
  now: 114,
  connected: true,
  stop: null,
  ...more,
});

const bits = (level: "failure" | "warning" | "notification", word: number) => ({
  faults: { ...servo().faults, [level]: word },
});

describe("conditionOf", () => {
  test.each<[string, Partial<KnownServo>, string, string]>([
    ["well", {}, "ok", "OK"],
    ["a notice", bits("notification", 1 << 8), "notice", "Notice: at CW angle limit"],
    ["a warning", bits("warning", 1 << 4), "warning", "Warning: weak sensor magnet"],
    ["a failure", bits("failure", 1 << 1), "failure", "Failure: motor signal"],
    [
      "several bits",
      bits("warning", (1 << 4) | (1 << 8)),
      "warning",
      "Warning: weak sensor magnet and 1 more",
    ],
    ["a bit without a name", bits("failure", 2 ** 31), "failure", "Failure: bit 31 (undocumented)"],
    ["saving", { state: "saving" }, "busy", "Saving to ROM"],
    ["soft start", { state: "soft_start" }, "busy", "Soft start"],
    ["identifying", { state: "identifying" }, "identifying", "Identifying"],
    [
      "a failure while saving",
      { state: "saving", ...bits("failure", 2) },
      "failure",
      "Failure: motor signal",
    ],
    [
      "offline",
      { online: false, state: "offline", ...bits("failure", 2) },
      "offline",
      "Offline for 14\u202fs",
    ],
    ["silent while it restarts", { online: false, state: "restarting" }, "busy", "Restarting"],
    ["never seen", { online: false, state: "offline", angleAt: null }, "offline", "Offline"],
    ["health without bits", { health: "critical" }, "failure", "Failure: node health is CRITICAL"],
    ["words not read yet", { faults: { notification: null, warning: null, failure: null } }, "ok", "OK"],
  ])("%s", (_, more, kind, headline) => {
    expect(conditionOf(servo(more), facts())).toMatchObject({ kind, headline });
  });

  test("protection says how hot it is, where that is why", () => {
    const hot = servo({ state: "protected", ...bits("warning", 1 << 8) });
    expect(conditionOf(hot, facts({ temperature: 81 })).headline).toBe("Protected: 81\u202f°C, output off");
    expect(conditionOf(hot, facts()).headline).toBe("Protected: temperature high");
  });

  test("an offline servo's remedy is where the fault is", () => {
    const away = servo({ online: false, state: "offline" });
    expect(conditionOf(away, facts()).line).toMatch(/^Last seen .*\. Check its supply$/);
    expect(conditionOf(away, facts({ connected: false })).line).toMatch(/\. Connect the bus$/);
  });

  test("a well servo says what its output does, and a notice does not hide that it is off", () => {
    const off = { output: { state: "off", reason: "stop", by: "Rig 3", since: null } } as const;
    expect(conditionOf(servo(), facts()).line).toBe("Holding");
    expect(conditionOf(servo(off), facts())).toEqual({
      kind: "ok",
      headline: "OK",
      line: "Output off: stopped by Rig 3",
    });
    const noticed = conditionOf(servo({ ...off, ...bits("warning", 1 << 4) }), facts());
    expect([noticed.line, noticed.doing]).toEqual(["Plan a repair.", "Output off: stopped by Rig 3"]);
    const hot = servo({
      state: "protected",
      output: { state: "off", reason: "protection", by: null, since: null },
    });
    expect(conditionOf(hot, facts()).doing).toBeUndefined();
    expect(conditionOf(servo({ ...off, online: false, state: "offline" }), facts()).doing).toBeUndefined();
  });

  const doing = (state: Servo["activity"]["state"], more: Partial<Servo["activity"]> = {}) => ({
    activity: { ...servo().activity, state, ...more },
  });

  test.each<[Servo["activity"]["state"], string]>([
    ["holding", "Holding"],
    ["moving", "Moving"],
    ["turning", "Rotating"],
    ["held_after_timeout", "Held after timeout (0x26)"],
  ])("a well servo that is %s says so", (state, line) => {
    expect(conditionOf(servo(doing(state)), facts())).toMatchObject({ kind: "ok", headline: "OK", line });
  });

  test("a timeout that released torque is reported, not a hold", () => {
    const output = { state: "off", reason: "timeout", by: null, since: null } as const;
    const found = conditionOf(servo({ ...doing("released"), output }), facts());
    expect(found.line).toBe("Torque off: command timeout (0x26)");
    expect(found.doing).toBeUndefined();
  });

  test("hunting and saturation at rest are marked, above a notice and beside a warning", () => {
    const hunting = doing("hunting", { peak_to_peak_deg: 2 });
    expect(conditionOf(servo(hunting), facts())).toMatchObject({
      kind: "warning",
      headline: "Warning: hunting, 2.0° peak to peak",
    });
    expect(conditionOf(servo(hunting), facts()).doing).toBeUndefined();
    expect(conditionOf(servo({ ...hunting, ...bits("notification", 1 << 8) }), facts()).kind).toBe("warning");
    const both = conditionOf(servo({ ...hunting, ...bits("warning", 1 << 4) }), facts());
    expect([both.headline, both.doing]).toEqual([
      "Warning: weak sensor magnet",
      "Hunting, 2.0° peak to peak",
    ]);
    const saturated = doing("saturated", { torque_pct: -94, torque_limit_pct: 100 });
    expect(conditionOf(servo(saturated), facts()).headline).toBe(
      "Warning: saturated, torque 94\u202f% of 100\u202f%",
    );
  });

  test("while stopped each says whether it confirmed", () => {
    const stop = (confirmed: boolean): Stop => ({
      latched: true,
      mode: "off",
      at: 0,
      by: "you",
      reason: "",
      servos: [{ uid: servo().uid, label: "Gripper", confirmed, ms: confirmed ? 4.2 : null }],
      nodes: [],
      reach: "all" as const,
      reaches: [],
    });
    expect(conditionOf(servo(), facts({ stop: stop(true) })).line).toBe("Torque off, confirmed in 4\u202fms");
    expect(conditionOf(servo(), facts({ stop: stop(false) }))).toMatchObject({
      line: "No response to the stop",
      alarming: true,
    });
  });

  test("lost saved values link to the snapshots, also with a more severe fault", () => {
    const table = [
      ...faults,
      { level: "warning", bit: 15, key: "rom_lost", label: "Saved values lost", advice: "" },
    ];
    const reported = (word: number, failure = 0) =>
      conditionOf(
        servo({ faults: { notification: 0, warning: word, failure } }),
        facts({ faults: table as ConditionFacts["faults"] }),
      );
    expect(reported(1 << 15).romLost).toBe(true);
    expect(reported(1 << 15, 1 << 1)).toMatchObject({ kind: "failure", romLost: true });
    expect(reported(1 << 4).romLost).toBeUndefined();
  });

  test("what needs attention", () => {
    expect((["ok", "busy", "identifying"] as const).map(needsAttention)).toEqual([false, false, false]);
    expect((["notice", "warning", "protected", "failure", "offline"] as const).every(needsAttention)).toBe(
      true,
    );
  });
});
