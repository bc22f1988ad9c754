/** Owns the catalogue of everything the page says, in Japanese. */
import { text as english } from "./en";
import { said } from "./ja/said";
import { whole } from "./whole";

export const text = whole(english, said);
