/** Presets: stored per servo, confirmed before one is lost, restored after a reload. */
import { beforeEach, expect, test, vi } from "vitest";

const [A, B] = ["a".repeat(32), "b".repeat(32)] as const;
const again = async () => {
  vi.resetModules();
  return import("./presets");
};

beforeEach(() => localStorage.clear());

test("a stored angle is this servo's own, in steps of the register, and is there after a reload", async () => {
  const first = await again();
  first.requestPreset(A, "a", -30.04);
  expect([first.presetOf(A, "a"), first.presetOf(A, "b"), first.presetOf(B, "a")]).toEqual([-30, null, null]);
  expect(first.replacing.value).toBeNull();
  expect((await again()).presetOf(A, "a")).toBe(-30);
});

test("replacing another preset needs confirmation, the same one does not", async () => {
  const { requestPreset, presetOf, replacing } = await again();
  requestPreset(A, "b", 12);
  requestPreset(A, "b", 12.04);
  expect(replacing.value).toBeNull();
  requestPreset(A, "b", 15);
  expect(replacing.value).toEqual({ uid: A, preset: "b", from: 12, by: 15 });
  expect(presetOf(A, "b")).toBe(12);
});

test.each(["no list", "null", "[1]", `{"${A}": null}`, `{"${A}": {"a": "9", "c": 4}}`])(
  "what was never stored so is no preset: %s",
  async found => {
    localStorage.setItem("hornbill.presets", found);
    const { presetOf, storePreset } = await again();
    expect(presetOf(A, "a")).toBeNull();
    storePreset(A, "a", 5);
    expect(presetOf(A, "a")).toBe(5);
  },
);
