/** Text of this folder, loaded with the first module that imports it. */
import { wordsIn } from "../text/language";

export const site = wordsIn(
  () => import("./text.en"),
  () => import("./text.ja"),
);
