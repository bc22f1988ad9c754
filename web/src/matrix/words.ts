/** Words of this folder, loaded with the first part that imports them. */
import { wordsIn } from "../text/language";

export const matrix = wordsIn(
  () => import("./text.en"),
  () => import("./text.ja"),
);
