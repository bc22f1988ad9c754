/** Words of confirmation: those a rejection requires, and those still open. */
import { expect, test } from "vitest";
import { Problem } from "../api/client";
import { isOpen, withTick, wordsOf } from "./safety-words";

const refused = (facts: Record<string, unknown>, code = "needs_confirmation") =>
  new Problem(code, 409, "", facts);

test("a rejection requires its word, or one of several", () => {
  expect(wordsOf(refused({ confirm: "supply" }))).toEqual(["supply"]);
  const choices = ["torque_on_in_rom", "torque_off_in_rom"];
  expect(wordsOf(refused({ confirm: "torque_off_in_rom", choices }))).toEqual(choices);
  expect(wordsOf(refused({ confirm: "supply" }, "busy"))).toEqual([]);
  expect(wordsOf(refused({}))).toEqual([]);
});

test("each confirmation is required, and one of the two about torque is enough", () => {
  expect(isOpen([], [])).toBe(false);
  expect(isOpen(["supply"], [])).toBe(true);
  expect(isOpen(["supply", "temperature"], ["supply"])).toBe(true);
  expect(isOpen(["torque_on_in_rom", "torque_off_in_rom"], ["torque_off_in_rom"])).toBe(false);
});

test("torque on and torque off exclude one another", () => {
  const off = withTick(["supply"], "torque_off_in_rom", true);
  expect(off).toEqual(["supply", "torque_off_in_rom"]);
  expect(withTick(off, "torque_on_in_rom", true)).toEqual(["supply", "torque_on_in_rom"]);
  expect(withTick(off, "torque_off_in_rom", false)).toEqual(["supply"]);
});
