/** Words of this folder, loaded with the first part that imports them. */
import { wordsIn } from "../text/language";

export const audit = wordsIn(
  () => import("./audit.en"),
  () => import("./audit.ja"),
);
export const takeOver = wordsIn(
  () => import("./take-over.en"),
  () => import("./take-over.ja"),
);
export const servoWords = wordsIn(
  () => import("./text.en"),
  () => import("./text.ja"),
);
