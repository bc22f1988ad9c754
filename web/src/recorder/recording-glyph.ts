/** Glyphs of the reasons for a recording. */
import type { ConditionKind } from "../bench/condition";

export const GLYPHS: Readonly<Record<string, ConditionKind>> = {
  failure: "failure",
  stop: "warning",
  lost: "offline",
  bus_lost: "offline",
  manual: "ok",
};
