/** Measured quantities have readable units, and as many digits as their interval allows. */
import { expect, test } from "vitest";
import { scaled } from "./mechanics-units";

test.each([
  ["coulomb", "", { value: 0.0203, low: 0.019, high: 0.0217 }, { unit: "%", scale: 100, decimals: 2 }],
  ["torque_lag_s", "s", { value: 0.003, low: 0.002, high: 0.004 }, { unit: "ms", scale: 1000, decimals: 1 }],
  ["inertia", "", { value: 2.97, low: 2.93, high: 3.02 }, { unit: "×", scale: 1, decimals: 3 }],
  ["stop_cw_deg", "°", { value: 40, low: 10, high: 70 }, { unit: "°", scale: 1, decimals: 0 }],
  ["deadband_deg", "°", { value: 0.4, low: 0.4, high: 0.4 }, { unit: "°", scale: 1, decimals: 2 }],
  ["backlash_deg", "°", null, { unit: "°", scale: 1, decimals: 2 }],
] as const)("%s", (name, unit, estimate, shown) => {
  expect(scaled({ name, unit, estimate })).toEqual(shown);
});
