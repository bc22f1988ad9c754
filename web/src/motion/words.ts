/** Text of this folder, loaded with the first module that imports it. */
import { wordsIn } from "../text/language";

export const jogging = wordsIn(
  () => import("./jog.en"),
  () => import("./jog.ja"),
);
