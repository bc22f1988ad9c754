/** Prediction of the horn's movement in a save, from the values ROM will have rather than RAM now. */
import type { Value } from "../api/types";
import { saving } from "../change/words";

export type Prediction = "soft_start" | "hold" | "off" | "brake" | "unknown";

/** `will` returns the value of a key in ROM after the save; undefined if never read. */
export function predict(will: (key: string) => Value | undefined): Prediction {
  const torque = will("torque_mode");
  if (torque === "off") return "off";
  if (torque === "brake") return "brake";
  const soft = will("soft_start");
  if (torque !== "on" || typeof soft !== "boolean") return "unknown";
  return soft ? "soft_start" : "hold";
}

/** True if the user must confirm that the horn can turn freely. */
export function mayMove(prediction: Prediction): boolean {
  return prediction === "soft_start" || prediction === "unknown";
}

/** The second line of the save button. */
export function sideEffect(prediction: Prediction, name: string): string {
  const strings = saving.sub;
  switch (prediction) {
    case "soft_start":
      return strings.softStart(name);
    case "hold":
      return strings.hold(name);
    case "off":
      return strings.off(name);
    case "brake":
      return strings.brake(name);
    case "unknown":
      return strings.unknown(name);
  }
}
