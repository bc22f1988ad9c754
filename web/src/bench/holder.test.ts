/** Who a tab is to others: the same over a reload, somebody else in a copy, in no language but the server's. */
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
  expect(before).toMatch(/^Page \d{4}$/);
  dispatchEvent(new Event("pagehide"));
  expect(await loaded()).toBe(before);
});

test("a copy of a tab that is open has another name", async () => {
  vi.spyOn(Math, "random").mockReturnValueOnce(0.25).mockReturnValueOnce(0.75);
  const first = await loaded();
  // The copy begins with what the store of the first holds while that is open.
  expect(await loaded()).not.toBe(first);
});

test.each(['"x"', "-1", "1.5e9", "{"])("a store that holds %s is no harm", async kept => {
  sessionStorage.setItem("hornbill.tab", kept);
  expect(await loaded()).toMatch(/^Page \d{4}$/);
});

test("what is sent is in no language of the page, and what is shown is in the reader's", async () => {
  vi.resetModules();
  const { speak } = await import("../text/language");
  speak("ja", (await import("../text/ja")).text);
  const { holder, who } = await import("./holder");
  expect(holder()).toMatch(/^Page \d{4}$/);
  expect(who("Page 4170")).toBe("ページ4170");
  expect(who("alice · Page 4170")).toBe("alice · ページ4170");
  expect(who("Rig Page 3 left")).toBe("Rig Page 3 left");
});
