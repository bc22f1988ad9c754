/** What a step found: with what it said of steps to come while they come, and without it afterwards. */
import { expect, test } from "vitest";
import type { JobStep } from "../api/types";
import { evidenceText, stepText } from "./step-text";

const step = (evidence: string | null, ahead: string | null = null) => ({ evidence, ahead }) as JobStep;

test("what is ahead stands while the job runs, and not after the fact", () => {
  const one = step(
    "30 rows read, supply 7.4 V. A load may drop. Support it.",
    "A load may drop. Support it.",
  );
  expect(evidenceText(one, false)).toBe("30 rows read, supply 7.4 V. A load may drop. Support it.");
  expect(evidenceText(one, true)).toBe("30 rows read, supply 7.4 V.");
});

test("other evidence stays", () => {
  expect(evidenceText(step("once"), true)).toBe("once");
  expect(evidenceText(step(null), true)).toBe("");
});

test("a step is called by the kind of its job and its code, with or without its servo", () => {
  const one = {
    code: "write",
    params: { servo: "Rudder" },
    text: "said by the server",
  } as unknown as JobStep;
  expect(stepText("profile", one)).toBe("Rudder: Written and read back");
  expect(stepText("profile", one, true)).toBe("Written and read back");
  expect(stepText("restart", one)).toBe("said by the server");
});

test("a step of a test plan is called by its number and values", () => {
  const one = { code: "move", params: { servo: "Rudder", step: 2, angle_deg: -10 } } as unknown as JobStep;
  expect(stepText("plan", one)).toBe("Rudder: 2. Move to −10.0°");
  expect(stepText("plan", { ...one, code: "torque_off", params: {} }, true)).toBe("Torque off");
});

test("a failed step gives its reason, without the part for programs", () => {
  const failed = {
    ...step("No bus. PUT /api/v1/bus."),
    evidence_code: "problem",
    evidence_params: { problem: "bus_disconnected", summary: "No bus." },
  } as JobStep;
  expect(evidenceText(failed, true)).toBe("No bus.");
});
