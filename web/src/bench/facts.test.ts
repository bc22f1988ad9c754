/** Values of a code as text: each number has the unit that its name ends in, and no other. */
import { expect, test } from "vitest";
import { factsOf } from "./facts";

test.each([
  ["silence_s", 0.5, "0.5\u202fs"],
  ["supply_v", 12, "12\u202fV"],
  ["load_pct", 40, "40\u202f%"],
  ["frames_per_s", 249, "249"],
  ["count", 2, "2"],
  ["angle_deg", 1.1, "+1.1°"],
  ["swing_deg", 1.1, "1.1°"],
])("%s", (name, value, said) => {
  expect(factsOf({ [name]: value })[name]).toBe(said);
});
