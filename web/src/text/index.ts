/** Words of every page, in the language chosen at start. */
import { loadedText } from "./language";

export const text = loadedText();
