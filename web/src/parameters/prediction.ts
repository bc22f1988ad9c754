/** What a save will do to the horn, told from what will be in ROM, not from what is in RAM now. */
import type { Value } from "../api/types";
import { saving } from "../change/words";

export type Prediction = "soft_start" | "hold" | "off" | "brake" | "unknown";

/** `will` gives the value a key will have in ROM; undefined while it was never read. */
export function predict(will: (key: string) => Value | undefined): Prediction {
  const torque = will("torque_mode");
  if (torque === "off") return "off";
  if (torque === "brake") return "brake";
  const soft = will("soft_start");
  if (torque !== "on" || typeof soft !== "boolean") return "unknown";
  return soft ? "soft_start" : "hold";
}

/** Whether somebody has to say that the horn can turn freely. */
export function mayMove(prediction: Prediction): boolean {
  return prediction === "soft_start" || prediction === "unknown";
}

/** The second line of the save button. */
export function sideEffect(prediction: Prediction, name: string): string {
  const said = saving.sub;
  switch (prediction) {
    case "soft_start":
      return said.softStart(name);
    case "hold":
      return said.hold(name);
    case "off":
      return said.off(name);
    case "brake":
      return said.brake(name);
    case "unknown":
      return said.unknown(name);
  }
}
