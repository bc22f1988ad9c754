/** Words of this folder, loaded with the parts that first show them. */
import { wordsIn } from "../text/language";

export const headings = wordsIn(
  () => import("./groups.en"),
  () => import("./groups.ja"),
);
