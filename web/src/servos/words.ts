/** The words of parts of this folder that are fetched when first shown. */
import { wordsIn } from "../text/language";

export const headings = wordsIn(
  () => import("./groups.en"),
  () => import("./groups.ja"),
);
