/** Which language the page speaks: the wish, where it is kept, and the catalogue that is loaded for it. */
import type { text } from "./en";
import type { topics } from "./topics.en";

export type Language = "en" | "ja";
/** What is said on any page; every catalogue has this shape. */
export type Text = Said<typeof text>;
/** What is said by parts of the page that are fetched when they are first shown. */
export type Topics = Said<typeof topics>;

/** The shape of a catalogue in another language: the same keys and slots, other words. */
export type Said<T> = T extends string
  ? string
  : T extends (...slots: infer Slots) => infer Sentence
    ? (...slots: Slots) => Said<Sentence>
    : { [Key in keyof T]: Said<T[Key]> };

/** How each language calls itself, and where its words are. Only the chosen one is fetched. */
export const LANGUAGES = {
  en: {
    name: "English",
    text: () => import("./en").then(file => file.text),
    topics: () => import("./topics.en").then(file => file.topics),
  },
  ja: {
    name: "日本語",
    text: () => import("./ja").then(file => file.text),
    topics: () => import("./topics.ja").then(file => file.topics),
  },
} as const satisfies Record<
  Language,
  { name: string; text: () => Promise<Text>; topics: () => Promise<Topics> }
>;

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
let knownTopics: Topics | null = null;

/** Takes catalogues that are here already; tests begin with it. */
export function speak(words: Text, more: Topics): void {
  known = words;
  knownTopics = more;
}

/** Fetches what every page says in the chosen language; the topics follow with the first part that is fetched. */
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

/** Resolves when the topics are here: before any part of the page that is fetched is run. */
export async function topicsLoaded(): Promise<void> {
  knownTopics ??= await LANGUAGES[spoken()].topics();
}

/** The loaded catalogue. */
export function loadedText(): Text {
  if (known === null) throw new Error("Text is used before its language is loaded.");
  return known;
}

/** The loaded topics. */
export function loadedTopics(): Topics {
  if (knownTopics === null) throw new Error("A topic is used before its language is loaded.");
  return knownTopics;
}
