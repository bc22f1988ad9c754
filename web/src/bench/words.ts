/** Words of this folder, loaded with the first part that imports them. */
import { wordsIn } from "../text/language";

export const help = wordsIn(
  () => import("./row-help.en"),
  () => import("./row-help.ja"),
);
