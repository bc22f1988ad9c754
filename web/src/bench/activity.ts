/** Texts of a servo's activity as reported by the server, for every place that shows it. */
import type { Servo } from "../api/types";
import { text } from "../text";
import { servo } from "./fleet";
import { number, signed, withUnit } from "./format";
import { type Figure, figureNow } from "./fresh";
import { held } from "./hold-to-run";
import { up } from "./link";
import { motion } from "./motion";
import { outputLine } from "./output";
import { sheetOf } from "./parameters";

export type Activity = Servo["activity"];

/** Hunting or saturated at rest: marked wherever the servo is shown. */
export function alarming({ state }: Activity): boolean {
  return state === "hunting" || state === "saturated";
}

/** One line: "Rotating", "Hunting, 2.0° peak to peak", "Output off: stopped by you, 14:03". */
export function activityLine({ activity, output }: Pick<Servo, "activity" | "output">): string {
  const strings = text.activity;
  const away = output.state === "off" || output.state === "brake";
  if (away && activity.state !== "released") return outputLine(output);
  switch (activity.state) {
    case "hunting": {
      const { peak_to_peak_deg: swing, oscillation_hz: hz } = activity;
      if (swing === null) return strings.hunting;
      return strings.huntingBy(
        withUnit(number(swing, 1), "°"),
        hz === null ? null : withUnit(number(hz, 0), "Hz"),
      );
    }
    case "saturated": {
      const torque = activity.torque_pct;
      if (torque === null) return strings.saturated;
      const limit = withUnit(number(activity.torque_limit_pct, 0), "%");
      return strings.saturatedAt(withUnit(number(Math.abs(torque), 0), "%"), limit);
    }
    case "released":
      return strings.released;
    case "off":
    case "brake":
    case "unknown":
      return outputLine(output);
    default:
      return strings[activity.state];
  }
}

export type CommandShown =
  | { kind: "angle"; figure: Figure }
  | { kind: "speed" | "torque"; figure: Figure }
  /** No command is active; `stale` if that was not read, or is old. */
  | { kind: "none"; figure: Figure };

const OTHERS = [
  ["speed", "command_speed"],
  ["torque", "command_torque"],
] as const;

/** The active command: that of this page, else the servo's in 0x00 to 0x02. */
export function commandNow(uid: string): CommandShown {
  const going = held.value;
  const present = motion.value;
  if (going !== null && present.phase === "on" && present.uid === uid) {
    return { kind: going.kind, figure: { value: going.value, age: 0, stale: false } };
  }
  const figure = figureNow(uid, "command_angle");
  if (figure.value !== null) return { kind: "angle", figure };
  // The dummy value reads as a gap: a command of another kind, or none.
  for (const [kind, key] of OTHERS) {
    const other = figureNow(uid, key);
    if (other.value !== null) return { kind, figure: other };
  }
  const known = sheetOf(uid).reading("command_angle").value !== undefined;
  return {
    kind: "none",
    figure: { value: null, age: null, stale: !known || !up.value || !servo(uid)?.online },
  };
}

/** A speed or torque with its sign and unit. */
export function driveText(kind: "speed" | "torque", value: number): string {
  return withUnit(signed(value, 0), kind === "speed" ? "rpm" : "%");
}
