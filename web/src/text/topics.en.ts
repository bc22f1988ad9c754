/** The English sentences of parts of the page that are fetched when first shown: a name for each topic. */

import { words as findings } from "../bus/findings.en";
import { words as bus } from "../bus/text.en";
import { words as changing } from "../change/changing.en";
import { words as help } from "../change/row-help.en";
import { words as saving } from "../change/saving.en";
import { words as steps } from "../change/steps.en";
import { words as editing } from "../change/text.en";
import { words as commission } from "../commission/text.en";
import { words as faults } from "../faults/text.en";
import { words as keys } from "../frame/keys.en";
import { words as login } from "../login/text.en";
import { words as matrix } from "../matrix/text.en";
import { words as jogging } from "../motion/jog.en";
import { words as overview } from "../overview/text.en";
import { words as plots } from "../plots/text.en";
import { words as recorder } from "../records/recorder.en";
import { words as records } from "../records/text.en";
import { words as api } from "../requests/text.en";
import { words as scope } from "../scope/text.en";
import { words as takeOver } from "../servo/take-over.en";
import { words as tune } from "../tune/text.en";
import { view } from "../view3d/text.en";

export const topics = {
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
};
