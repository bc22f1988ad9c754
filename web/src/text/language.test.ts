/** Which language the page speaks: the one chosen here before, else the browser's, else English. */
import { afterEach, expect, test, vi } from "vitest";
import { chosen } from "./language";

afterEach(() => localStorage.clear());

test.each([
  [null, ["ja-JP", "en"], "ja"],
  [null, ["de-DE", "ja", "en"], "ja"],
  [null, ["de-DE", "fr"], "en"],
  [null, ["en-GB", "ja"], "en"],
  ["en", ["ja"], "en"],
  ["ja", ["en"], "ja"],
  ["xx", ["ja"], "ja"],
] as const)("kept %s, browser %j: %s", (kept, wishes, language) => {
  vi.spyOn(navigator, "languages", "get").mockReturnValue(wishes);
  if (kept) localStorage.setItem("hornbill.language", kept);
  expect(chosen()).toBe(language);
});
