/** Words for what the server keeps as words of its own. */
import { expect, test } from "vitest";
import type { AuditRow } from "../api/config-types";
import { auditedNotes, auditWord, reasonText } from "./audit-text";

test.each([
  ["manual", {}, "Taken manually"],
  ["saving", {}, "Before a save to ROM"],
  ["change", { key: "a_row", more: 0 }, "Before changing a_row"],
  ["change", { key: "a_row", more: 2 }, "Before changing a_row and 2 more"],
  ["profile", { profile: "Wing, left" }, "Before applying profile Wing, left"],
  ["restore", { side: "snapshot 12", snapshot: 12 }, "Before restoring snapshot 12"],
  [null, {}, "before the first flight"],
] as const)("why a snapshot was taken: %s", (code, params, words) => {
  expect(reasonText("before the first flight", code, params)).toBe(words);
});

test("a row of the audit says its notes by their codes, and a user's own words stay", () => {
  const notes: AuditRow["notes"] = [
    { code: "reason", params: { reason: "matrix" }, text: "matrix" },
    { code: "text", params: {}, text: "by Ann" },
    { code: "stop_of", params: { by: "Ann" }, text: "Stop of Ann cleared." },
  ];
  expect(auditedNotes({ notes } as AuditRow)).toEqual([
    "Before changing several servos",
    "by Ann",
    "Stop of Ann cleared.",
  ]);
});

test("words of the audit that are not known are shown without underscores", () => {
  expect(auditWord("no_response")).toBe("no response");
  expect(auditWord("something_new")).toBe("something new");
});
