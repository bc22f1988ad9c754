/** The shape a bundle's reason has. */
import type { Kind } from "../bench/condition";

export const GLYPHS: Readonly<Record<string, Kind>> = {
  failure: "failure",
  stop: "warning",
  lost: "offline",
  bus_lost: "offline",
  by_hand: "ok",
};
