/** Staged edits over a reload of the page. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Reading, Row } from "../api/types";

const A = "a".repeat(32);
const B = "b".repeat(32);
const row = {
  key: "limit",
  kind: "number",
  unit: "%",
  per_unit: 1,
  choices: [],
  access: "rw",
} as unknown as Row;
const reading = {
  key: "limit",
  value: 40,
  raw: 40,
  unit: "%",
  minimum: 0,
  maximum: 100,
  age_s: 0,
} as Reading;

/** The modules as a page that was just loaded has them. */
async function page() {
  vi.resetModules();
  await import("../text/setup");
  const { sheetOf } = await import("./parameters");
  const { hasDrafts } = await import("./draft-store");
  const { replaceAll } = await import("./fleet");
  const { catalog } = await import("./catalog");
  const { reload, warnBeforeLeaving } = await import("./reload");
  catalog.value = { revision: "", tabs: [], rows: new Map([[row.key, row]]), faults: [] };
  replaceAll([A, B].map(uid => ({ uid, online: true, age_s: 0 }) as never));
  return { sheetOf, hasDrafts, replaceAll, reload, warnBeforeLeaving };
}

beforeEach(() => sessionStorage.clear());
afterEach(() => vi.unstubAllGlobals());

test("what was staged is there again, with its verdict by what the row allows now", async () => {
  const before = await page();
  const sheet = before.sheetOf(A);
  sheet.put(reading);
  sheet.drafts.put("limit", { text: "90", verdict: { ok: true, value: 90 } });
  before.sheetOf(B).drafts.put("mode", { text: "off", verdict: { ok: true, value: "off" } });
  before.sheetOf(B).drafts.put("limit", { text: "nine", verdict: { ok: false } as never });
  expect(before.hasDrafts()).toBe(true);

  const after = await page();
  expect(after.hasDrafts()).toBe(true);
  const again = after.sheetOf(A);
  expect(again.drafts.map.value.get("limit")).toEqual({ text: "90", verdict: { ok: true, value: 90 } });
  again.put({ ...reading, maximum: 80 });
  expect(again.drafts.map.value.get("limit")?.verdict).toMatchObject({ ok: false, code: "above" });
  const other = after.sheetOf(B);
  expect(other.drafts.map.value.get("mode")?.verdict).toEqual({ ok: true, value: "off" });
  expect(other.drafts.map.value.get("limit")?.verdict.ok).toBe(false);
  other.put(reading);
  expect(other.drafts.map.value.get("limit")?.verdict).toMatchObject({ code: "not_a_number" });
});

test("what was applied or discarded does not come back", async () => {
  const { sheetOf, hasDrafts } = await page();
  sheetOf(A).drafts.put("limit", { text: "90", verdict: { ok: true, value: 90 } });
  sheetOf(A).drafts.drop(["limit"]);
  expect(hasDrafts()).toBe(false);
  expect((await page()).sheetOf(A).drafts.map.value.size).toBe(0);
});

test.each(["{", "5", '{"x": 5}', `{"${A}": {"limit": 5}}`, `{"${A}": {"limit": null}}`])(
  "storage that holds %s is no harm",
  async stored => {
    sessionStorage.setItem("hornbill.drafts", stored);
    expect((await page()).sheetOf(A).drafts.map.value.size).toBe(0);
  },
);

test("without browser storage, drafts last as long as the page", async () => {
  const forbidden = () => {
    throw new DOMException("no", "SecurityError");
  };
  vi.stubGlobal("sessionStorage", { getItem: forbidden, setItem: forbidden, clear: () => undefined });
  const { sheetOf } = await page();
  sheetOf(A).drafts.put("limit", { text: "90", verdict: { ok: true, value: 90 } });
  expect(sheetOf(A).drafts.map.value.size).toBe(1);
});

test("leaving needs confirmation while a known servo has edits, but an automatic reload does not", async () => {
  const { sheetOf, hasDrafts, replaceAll, reload, warnBeforeLeaving } = await page();
  const confirms = () => {
    const event = new Event("beforeunload", { cancelable: true });
    dispatchEvent(event);
    return event.defaultPrevented;
  };
  warnBeforeLeaving(hasDrafts);
  expect(confirms()).toBe(false);
  sheetOf(B).drafts.put("limit", { text: "90", verdict: { ok: true, value: 90 } });
  expect(confirms()).toBe(true);
  replaceAll([{ uid: A, online: true, age_s: 0 } as never]);
  expect(confirms()).toBe(false);
  replaceAll([{ uid: B, online: true, age_s: 0 } as never]);
  vi.spyOn(location, "reload").mockImplementation(() => undefined);
  reload();
  expect(confirms()).toBe(false);
});
