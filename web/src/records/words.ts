/** The words of this folder; they are fetched with the first part that imports them. */
import { wordsIn } from "../text/language";

export const records = wordsIn(
  () => import("./text.en"),
  () => import("./text.ja"),
);
