/** What is said of models and firmware the tables have, and of those they do not. */
import { expect, test } from "vitest";
import { firmwareNote, modelName, readOnly, unfamiliar } from "./model";

const known = {
  model: "BLA21-06U-A0",
  model_number: 61,
  hardware_version: 6010,
  firmware: "1.300",
  firmware_note: "Futaba's 1.400 fixes a stall at low speed.",
  known_model: true,
  treated_as: { model: null, firmware: null },
};
const foreign = {
  ...known,
  model: null,
  model_number: 99,
  firmware: "3.210",
  firmware_note: null,
  known_model: false,
};

test("a known one has its name, a note on its firmware, and nothing else to be said", () => {
  expect(modelName(known)).toBe("BLA21-06U-A0");
  expect(unfamiliar(known)).toEqual([]);
  expect(firmwareNote(known)).toBe("Firmware 1.300: Futaba's 1.400 fixes a stall at low speed.");
  expect(readOnly(known)).toBe(false);
});

test("what stands for an unknown hardware or firmware number is named", () => {
  const other = {
    ...known,
    hardware_version: 6090,
    firmware: "1.900",
    firmware_note: null,
    treated_as: { model: "BLA21-06U-A0", firmware: "1.400" },
  };
  expect(modelName(other)).toBe("as BLA21-06U-A0");
  expect(unfamiliar(other)).toEqual([
    "Hardware 6090 is unknown. hornbill treats this servo as a BLA21-06U-A0, the newest known model of the series.",
    "Firmware 1.900 is unknown. hornbill treats it as 1.400, the newest known version before it.",
  ]);
  expect(firmwareNote(other)).toBe(null);
});

test("a servo of an unknown series can be read only", () => {
  expect(modelName(foreign)).toBe("Unknown series 99");
  expect(readOnly(foreign)).toBe(true);
  expect(unfamiliar(foreign)).toEqual([
    "hornbill does not support series 99. It reads this servo, takes snapshots and compares them, but writes nothing except torque off. Use a hornbill version that supports the series, or Futaba's own program.",
  ]);
});

test("a servo that has not said what it is yet is not called read only", () => {
  const silent = { ...foreign, model_number: null };
  expect(modelName(silent)).toBe("Unknown model");
  expect([readOnly(silent), unfamiliar(silent)]).toEqual([false, []]);
  expect(readOnly(undefined)).toBe(false);
});
