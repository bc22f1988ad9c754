/** The language of the tests: English, there before any of them is loaded. */
import { text } from "./en";
import { speak } from "./language";
import { topics } from "./topics.en";

speak(text, topics);
