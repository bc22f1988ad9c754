/** The language of the tests: English, loaded before any test. */
import { beforeAll } from "vitest";
import { text } from "./en";
import { setLanguage, wordsLoaded } from "./language";

setLanguage("en", text);
beforeAll(wordsLoaded);
