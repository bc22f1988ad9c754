/** Words of this folder, loaded with the first part that imports them. */
import { wordsIn } from "../text/language";

export const keys = wordsIn(
  () => import("./keys.en"),
  () => import("./keys.ja"),
);
