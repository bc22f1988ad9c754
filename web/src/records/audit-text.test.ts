/** Words for what the server keeps as words of its own. */
import { expect, test } from "vitest";
import type { AuditRow } from "../api/config-types";
import { auditedReason, auditWord, reasonText } from "./audit-text";

test.each([
  ["by_hand", {}, "Taken by hand"],
  ["saving", {}, "Before a save to ROM"],
  ["change", { key: "a_row", more: 0 }, "Before a change of a_row"],
  ["change", { key: "a_row", more: 2 }, "Before a change of a_row and 2 more"],
  ["profile", { profile: "Wing, left" }, "Before the profile Wing, left"],
  ["restore", { side: "snapshot 12", snapshot: 12 }, "Before snapshot 12 was restored"],
  [null, {}, "before the first flight"],
] as const)("why a snapshot was taken: %s", (code, params, words) => {
  expect(reasonText("before the first flight", code, params)).toBe(words);
});

test("a row of the audit says it from its requested value, and a user's own words stay", () => {
  const row = { detail: "matrix", requested: { reason: "matrix" } } as unknown as AuditRow;
  expect(auditedReason(row)).toBe("Before a change of several servos");
  expect(auditedReason({ detail: "by Ann", requested: null } as AuditRow)).toBe("by Ann");
});

test("words of the audit that are not known are shown without underscores", () => {
  expect(auditWord("no_answer")).toBe("no answer");
  expect(auditWord("something_new")).toBe("something new");
});
