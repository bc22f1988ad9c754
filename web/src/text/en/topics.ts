/** The English sentences of parts of the page that are fetched when first shown: a name for each topic. */
import { words as api } from "./api";
import { words as bus } from "./bus";
import { words as commission } from "./commission";
import { words as editing } from "./editing";
import { words as faults } from "./faults";
import { words as findings } from "./findings";
import { words as help } from "./help";
import { words as jogging } from "./jogging";
import { words as keys } from "./keys";
import { words as login } from "./login";
import { words as matrix } from "./matrix";
import { words as plots } from "./plots";
import { words as recorder } from "./recorder";
import { words as records } from "./records";
import { words as restarting } from "./restarting";
import { words as restoring } from "./restoring";
import { words as steps } from "./steps";
import { words as takeOver } from "./take-over";
import { words as tune } from "./tune";
import { view } from "./view";

export const topics = {
  api,
  bus,
  commission,
  editing,
  faults,
  findings,
  help,
  keys,
  jogging,
  login,
  matrix,
  plots,
  recorder,
  records,
  restarting,
  restoring,
  steps,
  takeOver,
  tune,
  view,
};
