/** The shape a recording's reason has. */
import type { ConditionKind } from "../bench/condition";

export const GLYPHS: Readonly<Record<string, ConditionKind>> = {
  failure: "failure",
  stop: "warning",
  lost: "offline",
  bus_lost: "offline",
  manual: "ok",
};
