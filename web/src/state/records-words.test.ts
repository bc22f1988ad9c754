/** Words for what the server keeps as words of its own. */
import { describe, expect, test } from "vitest";
import { auditWord, reasonText } from "./records-words";

describe("why a snapshot was taken", () => {
  test.each([
    ["by hand", "Taken by hand"],
    ["before saving", "Before a save to ROM"],
    ["profile Wing, left", "Before the profile Wing, left"],
    ["restore of snapshot 12", "Before snapshot 12 was restored"],
    ["before a change of nobody_knows", "before a change of nobody_knows"],
    ["before the first flight", "before the first flight"],
  ])("%s", (reason, words) => {
    expect(reasonText(reason)).toBe(words);
  });
});

test("words of the audit that are not known are shown without underscores", () => {
  expect(auditWord("no_answer")).toBe("no answer");
  expect(auditWord("something_new")).toBe("something new");
});
