/** The Japanese sentences of parts of the page that are fetched when first shown. */

import { words as findings } from "../bus/findings.ja";
import { words as bus } from "../bus/text.ja";
import { words as changing } from "../change/changing.ja";
import { words as help } from "../change/row-help.ja";
import { words as saving } from "../change/saving.ja";
import { words as steps } from "../change/steps.ja";
import { words as editing } from "../change/text.ja";
import { words as commission } from "../commission/text.ja";
import { words as faults } from "../faults/text.ja";
import { words as keys } from "../frame/keys.ja";
import { words as login } from "../login/text.ja";
import { words as matrix } from "../matrix/text.ja";
import { words as jogging } from "../motion/jog.ja";
import { words as overview } from "../overview/text.ja";
import { words as plots } from "../plots/text.ja";
import { words as recorder } from "../records/recorder.ja";
import { words as records } from "../records/text.ja";
import { words as api } from "../requests/text.ja";
import { words as scope } from "../scope/text.ja";
import { words as takeOver } from "../servo/take-over.ja";
import { words as tune } from "../tune/text.ja";
import { view } from "../view3d/text.ja";
import type { Topics } from "./language";

export const topics = {
  api,
  bus,
  changing,
  commission,
  editing,
  faults,
  findings,
  help,
  jogging,
  keys,
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
} satisfies Topics;
