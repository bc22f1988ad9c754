/** Which language the page speaks: the one chosen here before, else the browser's, else English. */
import { afterEach, expect, test, vi } from "vitest";
import { reload } from "../bench/reload";
import {
  chooseLanguage,
  chosenLanguage,
  currentLanguage,
  startLanguage,
  wordsIn,
  wordsLoaded,
} from "./language";

afterEach(() => {
  vi.unstubAllGlobals();
  localStorage.clear();
});

test.each([
  [null, ["ja-JP", "en"], "ja"],
  [null, ["de-DE", "ja", "en"], "ja"],
  [null, ["de-DE", "fr"], "en"],
  [null, ["en-GB", "ja"], "en"],
  ["en", ["ja"], "en"],
  ["ja", ["en"], "ja"],
  ["xx", ["ja"], "ja"],
] as const)("kept %s, browser %j: %s", (stored, languages, language) => {
  vi.spyOn(navigator, "languages", "get").mockReturnValue(languages);
  if (stored) localStorage.setItem("hornbill.language", stored);
  expect(chosenLanguage()).toBe(language);
});

test("a choice is kept, and the page loads again in it", () => {
  const loaded = vi.spyOn(location, "reload").mockImplementation(() => undefined);
  chooseLanguage("ja", reload);
  expect(localStorage.getItem("hornbill.language")).toBe("ja");
  expect(loaded).toHaveBeenCalledOnce();
});

test("where storage is forbidden the address keeps the choice", () => {
  const forbidden = () => {
    throw new DOMException("no", "SecurityError");
  };
  vi.stubGlobal("localStorage", { getItem: forbidden, setItem: forbidden, clear: () => undefined });
  const replace = vi.spyOn(location, "replace").mockImplementation(() => undefined);
  chooseLanguage("ja", reload);
  const address = new URL(String(replace.mock.calls[0]?.[0]));
  expect(address.search).toBe("?language=ja");
  history.replaceState(null, "", address.pathname + address.search);
  expect(chosenLanguage()).toBe("ja");
  history.replaceState(null, "", "/");
});

test("the page stays in the language it was loaded in when the address no longer names it", async () => {
  const loaded = vi.spyOn(location, "reload").mockImplementation(() => undefined);
  loaded.mockClear();
  vi.spyOn(navigator, "languages", "get").mockReturnValue(["en"]);
  history.replaceState(null, "", "/?language=ja");
  await startLanguage();
  history.replaceState(null, "", "/records");
  expect(currentLanguage()).toBe("ja");
  chooseLanguage("ja", reload);
  expect(loaded).not.toHaveBeenCalled();
  chooseLanguage("en", reload);
  expect(loaded).toHaveBeenCalledOnce();
  history.replaceState(null, "", "/");
});

test("words of a part are named before they are here, and read when they are", async () => {
  const here = { form: { title: "Form", rows: (n: number) => `${n} rows` } };
  const words = wordsIn(
    async () => ({ words: here }),
    async () => ({ words: here }),
  );
  const { form } = words;
  const { title } = form;
  expect(() => Object.keys(form)).toThrow("counted before");
  expect(() => "title" in form).toThrow("counted before");
  await wordsLoaded();
  expect([form.title, form.rows(2), words.form]).toEqual(["Form", "2 rows", here.form]);
  expect(() => title.length).toThrow("“Form” was read before");
});

test("words that could not be fetched are fetched with the next part", async () => {
  const fetched = vi.fn().mockRejectedValueOnce(new Error("no link"));
  const words = wordsIn<{ title: string }>(fetched, fetched);
  await expect(wordsLoaded()).rejects.toThrow("no link");
  fetched.mockResolvedValue({ words: { title: "Form" } });
  await wordsLoaded();
  expect(words.title).toBe("Form");
  await wordsLoaded();
  expect(fetched).toHaveBeenCalledTimes(2);
});
