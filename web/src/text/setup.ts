/** The language of the tests: English, there before any of them is loaded. */
import { text } from "./en";
import { topics } from "./en/topics";
import { speak } from "./language";

speak(text, topics);
