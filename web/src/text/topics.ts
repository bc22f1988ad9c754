/** What parts of the page that are fetched when first shown say, in the language chosen at start. */
import { loadedTopics } from "./language";

export const {
  api,
  bus,
  changing,
  commission,
  editing,
  faults,
  findings,
  help,
  keys,
  jogging,
  login,
  matrix,
  overview,
  plots,
  recorder,
  records,
  saving,
  scope,
  steps,
  takeOver,
  tune,
  view,
} = loadedTopics();
