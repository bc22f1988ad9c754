/** Name of a tab: kept over a reload, different in a copy, stored as a code. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";

/** The name of a page that loads now. */
async function loaded(): Promise<string> {
  vi.resetModules();
  await import("../text/setup");
  return (await import("./holder")).holder();
}

beforeEach(() => sessionStorage.clear());
afterEach(() => vi.resetModules());

test("a reload keeps the name", async () => {
  const before = await loaded();
  expect(before).toMatch(/^page-\d{4}$/);
  dispatchEvent(new Event("pagehide"));
  expect(await loaded()).toBe(before);
});

test("a copy of a tab that is open has another name", async () => {
  vi.spyOn(Math, "random").mockReturnValueOnce(0.25).mockReturnValueOnce(0.75);
  const first = await loaded();
  // The copy begins with what the store of the first holds while that is open.
  expect(await loaded()).not.toBe(first);
});

test.each(['"x"', "-1", "1.5e9", "{"])("a store that holds %s gets a new name", async stored => {
  sessionStorage.setItem("hornbill.tab", stored);
  expect(await loaded()).toMatch(/^page-\d{4}$/);
});

test("the name sent is a code, and the name shown is in the language of the page", async () => {
  vi.resetModules();
  const { setLanguage } = await import("../text/language");
  setLanguage("ja", (await import("../text/ja")).text);
  const { holder, who } = await import("./holder");
  expect(holder()).toMatch(/^page-\d{4}$/);
  expect(who("page-4170")).toBe("ページ4170");
  expect(who("alice · page-4170")).toBe("alice · ページ4170");
  expect(who("page-4170 stopped.")).toBe("ページ4170 stopped.");
  expect(who("Rig page-3 left, home-page-4170")).toBe("Rig page-3 left, home-page-4170");
});
