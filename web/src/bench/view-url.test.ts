import { expect, test } from "vitest";
import { viewUrl } from "./view-url";

const FRAME = { key: "k", uid: null, theme: "light" } as const;

function ratio(quality: "high" | "low", width: number, height: number): string | null {
  const url = viewUrl({ ...FRAME, quality, width, height });
  return new URL(url, "http://x").searchParams.get("fixedDpr");
}

test("low quality draws a limited number of pixels, and small frames finer", () => {
  expect(ratio("high", 1232, 651)).toBeNull();
  expect(ratio("low", 1232, 651)).toBe("0.85");
  expect(ratio("low", 444, 243)).toBe("1.50");
  expect(ratio("low", 0, 0)).toBe("1.50");
});
