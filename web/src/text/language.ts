/** Language of the page: choice, storage and catalogue. */
import type { text } from "./en";

export type Language = "en" | "ja";
/** Words of every page; all catalogues have this shape. */
export type Text = Translated<typeof text>;

/** The type of a catalogue in another language: same keys and slots. */
export type Translated<T> = T extends string
  ? string
  : T extends (...slots: infer Slots) => infer Sentence
    ? (...slots: Slots) => Translated<Sentence>
    : { [Key in keyof T]: Translated<T[Key]> };

/** Name of each language in itself, and its catalogue. Only the chosen one is loaded. */
export const LANGUAGES = {
  en: { name: "English", text: () => import("./en").then(file => file.text) },
  ja: { name: "日本語", text: () => import("./ja").then(file => file.text) },
} as const satisfies Record<Language, { name: string; text: () => Promise<Text> }>;

const KEY = "hornbill.language";
/** Query parameter that stores the choice where storage is blocked. */
const IN_ADDRESS = "language";

/** Language in the address, else the stored one, else the first supported one of the browser, else English. */
export function chosenLanguage(): Language {
  const requested = new URLSearchParams(location.search).get(IN_ADDRESS);
  if (requested === "en" || requested === "ja") return requested;
  try {
    const stored = localStorage.getItem(KEY);
    if (stored === "en" || stored === "ja") return stored;
  } catch {
    // Storage may be blocked: use the browser's languages.
  }
  for (const preferred of navigator.languages) {
    const plain = preferred.slice(0, 2).toLowerCase();
    if (plain === "en" || plain === "ja") return plain;
  }
  return "en";
}

/** Store the choice and reload the page: words are read once, when a part of the page is loaded. */
export function chooseLanguage(next: Language, reload: (address: string) => void): void {
  if (next === currentLanguage()) return;
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

/** Set a catalogue that is already loaded, in tests. */
export function setLanguage(language: Language, words: Text): void {
  started = language;
  known = words;
}

/** Load the catalogue of the chosen language. Words of other parts load with them (`wordsIn`). */
export async function startLanguage(): Promise<void> {
  const language = chosenLanguage();
  started = language;
  document.documentElement.lang = language;
  known = await LANGUAGES[language].text();
}

/** Language of this page. The address that set it may have changed since. */
export function currentLanguage(): Language {
  return started ?? chosenLanguage();
}

/** The loaded catalogue. */
export function loadedText(): Text {
  if (known === null) throw new Error("Text is used before its language is loaded.");
  return known;
}

/** Loaders of words that loaded parts are waiting for. */
const awaited = new Set<() => Promise<void>>();

/** Call `load` before the next part is shown, until it succeeds. */
export function awaitWords(load: () => Promise<void>): void {
  const fetchIt = async () => {
    await load();
    awaited.delete(fetchIt);
  };
  awaited.add(fetchIt);
}

/**
 * Words of a part, in the language of this page. A part may be imported before its words are loaded: `kit/lazy.tsx`
 * shows it once they are (`wordsLoaded`). So modules may name words at the top level, but read sentences only in
 * functions.
 */
export function wordsIn<Words extends object>(
  en: () => Promise<{ words: Words }>,
  ja: () => Promise<{ words: Translated<NoInfer<Words>> }>,
): Translated<Words> {
  let words: Translated<Words> | null = null;
  awaitWords(async () => {
    words = (await (currentLanguage() === "en" ? en() : ja())).words as Translated<Words>;
  });
  return readThrough(() => words);
}

/** A proxy whose keys are resolved when read. Before `whole` is loaded, its values are proxies, too. */
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

/** Resolves when the words of all loaded parts are loaded. */
export async function wordsLoaded(): Promise<void> {
  await Promise.all([...awaited].map(fetchIt => fetchIt()));
}
