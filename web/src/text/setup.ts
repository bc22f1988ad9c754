/** The language of the tests: English, there before any of them is run. */
import { beforeAll } from "vitest";
import { text } from "./en";
import { speak, wordsLoaded } from "./language";

speak("en", text);
beforeAll(wordsLoaded);
