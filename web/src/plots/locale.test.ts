/** Plots in a browser whose language is not a language tag. */
import { afterEach, expect, test, vi } from "vitest";

const own = Object.getOwnPropertyDescriptor(navigator, "language");

afterEach(() => {
  if (own) Object.defineProperty(navigator, "language", own);
  else Reflect.deleteProperty(navigator, "language");
});

async function languageFor(reported: string): Promise<string> {
  Object.defineProperty(navigator, "language", { value: reported, configurable: true });
  vi.resetModules();
  await import("./locale");
  return navigator.language;
}

test("a language that is not a tag is replaced, so that uPlot loads", async () => {
  expect(await languageFor("C")).toBe("en");
  expect((await import("uplot")).default).toBeTypeOf("function");
});

test("a language tag is kept", async () => {
  expect(await languageFor("ja-JP")).toBe("ja-JP");
});
