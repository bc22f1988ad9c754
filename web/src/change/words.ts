/** Words of this folder, loaded with the first part that imports them. */
import { wordsIn } from "../text/language";

export const actionWords = wordsIn(
  () => import("./actions.en"),
  () => import("./actions.ja"),
);
export const changing = wordsIn(
  () => import("./changing.en"),
  () => import("./changing.ja"),
);
export const editing = wordsIn(
  () => import("./text.en"),
  () => import("./text.ja"),
);
export const saving = wordsIn(
  () => import("./saving.en"),
  () => import("./saving.ja"),
);
export const steps = wordsIn(
  () => import("./steps.en"),
  () => import("./steps.ja"),
);
