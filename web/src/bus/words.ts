/** Text of this folder, loaded with the first module that imports it. */
import { wordsIn } from "../text/language";

export const busWords = wordsIn(
  () => import("./text.en"),
  () => import("./text.ja"),
);
export const findingWords = wordsIn(
  () => import("./findings.en"),
  () => import("./findings.ja"),
);
