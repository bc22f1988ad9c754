/** What the server notes beside a value, in Japanese, and in its own words for what the page does not know. */
import { expect, test, vi } from "vitest";
import type { NoteCode } from "../api/types";
import { text } from "../text/ja";
import { setLanguage } from "../text/language";

// Before anything that takes its words when it is loaded.
setLanguage("ja", text);
const { noteText, resultText } = await import("./note-text");

test("until its words are here a note is said in the server's", async () => {
  vi.resetModules();
  const language = await import("../text/language");
  language.setLanguage("ja", text);
  const { noteText: early } = await import("./note-text");
  const shown = () => early("It reached its limit.", "log_limit", { limit_mb: 2 });
  expect(shown()).toBe("It reached its limit.");
  await language.wordsLoaded();
  expect(shown()).toBe("上限の2\u202fMBに達しました。");
});

test("a note is said by its code, with its values", () => {
  expect(noteText("It reached its limit.", "log_limit", { limit_mb: 2 })).toBe(
    "上限の2\u202fMBに達しました。",
  );
});

test("a problem among notes is said by its cause", () => {
  const params = {
    problem: "log_failed",
    cause: "frames_missing",
    name: "a.log",
    summary: "There are none.",
  };
  expect(noteText("There are none.", "problem", params)).toBe(
    "a.logに29ビット識別子のCANフレームがありません。",
  );
});

test("a code that is not known leaves the server's words", () => {
  expect(noteText("Something new.", "new" as NoteCode, {})).toBe("Something new.");
  expect(resultText({ text: "2 of 2 done." })).toBe("2 of 2 done.");
  expect(resultText(null)).toBe("");
});
