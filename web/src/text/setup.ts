/** The language of the tests: English, loaded before any test. */
import { beforeAll } from "vitest";
import { text } from "./en";
import { speak, wordsLoaded } from "./language";

speak("en", text);
beforeAll(wordsLoaded);
