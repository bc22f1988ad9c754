/** Which language the page speaks: the wish, where it is kept, and the catalogue that is loaded for it. */
import type { text } from "./en";

export type Language = "en" | "ja";
/** What is said on any page; every catalogue has this shape. */
export type Text = Said<typeof text>;

/** The shape of a catalogue in another language: the same keys and slots, other words. */
export type Said<T> = T extends string
  ? string
  : T extends (...slots: infer Slots) => infer Sentence
    ? (...slots: Slots) => Said<Sentence>
    : { [Key in keyof T]: Said<T[Key]> };

/** How each language calls itself, and where its words are. Only the chosen one is fetched. */
export const LANGUAGES = {
  en: { name: "English", text: () => import("./en").then(file => file.text) },
  ja: { name: "日本語", text: () => import("./ja").then(file => file.text) },
} as const satisfies Record<Language, { name: string; text: () => Promise<Text> }>;

const KEY = "hornbill.language";
/** Where the storage is forbidden, the address keeps the choice. */
const IN_ADDRESS = "language";

/** The language the address asks for, else the one chosen here before, else the first of the browser's that there is, else English. */
export function chosenLanguage(): Language {
  const asked = new URLSearchParams(location.search).get(IN_ADDRESS);
  if (asked === "en" || asked === "ja") return asked;
  try {
    const kept = localStorage.getItem(KEY);
    if (kept === "en" || kept === "ja") return kept;
  } catch {
    // Storage may be forbidden; the browser's wish stands then.
  }
  for (const wish of navigator.languages) {
    const plain = wish.slice(0, 2).toLowerCase();
    if (plain === "en" || plain === "ja") return plain;
  }
  return "en";
}

/** Keeps the choice and loads the page again in it: words are read once, when a part of the page is loaded. */
export function chooseLanguage(next: Language, reload: (address: string) => void): void {
  if (next === spoken()) return;
  const address = new URL(location.href);
  address.searchParams.delete(IN_ADDRESS);
  try {
    localStorage.setItem(KEY, next);
  } catch {
    address.searchParams.set(IN_ADDRESS, next);
  }
  reload(address.href);
}

let started: Language | null = null;
let known: Text | null = null;

/** Takes a catalogue that is here already; tests begin with it. */
export function speak(language: Language, words: Text): void {
  started = language;
  known = words;
}

/** Fetches what every page says in the chosen language; the words of other parts come with them (`wordsIn`). */
export async function startLanguage(): Promise<void> {
  const language = chosenLanguage();
  started = language;
  document.documentElement.lang = language;
  known = await LANGUAGES[language].text();
}

/** The language of this page: the address that asked for it may be gone since it was loaded. */
export function spoken(): Language {
  return started ?? chosenLanguage();
}

/** The loaded catalogue. */
export function loadedText(): Text {
  if (known === null) throw new Error("Text is used before its language is loaded.");
  return known;
}

/** What fetches words of parts that are here while they are not. */
const awaited = new Set<() => Promise<void>>();

/** Calls `load` before the next part is shown, until it has succeeded. */
export function awaitWords(load: () => Promise<void>): void {
  const fetchIt = async () => {
    await load();
    awaited.delete(fetchIt);
  };
  awaited.add(fetchIt);
}

/**
 * The words of a part, in the language of this page. A part that imports them may be run before they are here:
 * `kit/lazy.tsx` shows it when they are (`wordsLoaded`). So modules name them at will and read sentences in functions.
 */
export function wordsIn<Words extends object>(
  en: () => Promise<{ words: Words }>,
  ja: () => Promise<{ words: Said<NoInfer<Words>> }>,
): Said<Words> {
  let words: Said<Words> | null = null;
  awaitWords(async () => {
    words = (await (spoken() === "en" ? en() : ja())).words as Said<Words>;
  });
  return readThrough(() => words);
}

/** An object whose keys are looked up when they are read; before `whole` is here, what they name is one, too. */
function readThrough<T extends object>(whole: () => T | null): T {
  const get = (_: object, key: string) => {
    const there = whole();
    if (there === null) return readThrough(() => Reflect.get(whole() ?? {}, key) ?? null);
    if (typeof there === "object") return Reflect.get(there, key);
    throw new Error(`“${there}” was read before it was here. Read it in a function.`);
  };
  const refuse = () => {
    throw new Error("Words were counted before they were here. Count them in a function.");
  };
  return new Proxy({}, { get, has: refuse, ownKeys: refuse }) as T;
}

/** Resolves when the words of every part that is here are here, too. */
export async function wordsLoaded(): Promise<void> {
  await Promise.all([...awaited].map(fetchIt => fetchIt()));
}
