/** Torque off without motion control: it needs no lease and asks nothing. */
import { problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { sheetOf } from "../bench/parameters";
import { send } from "./send";

/** Null when torque is off, or the servo brakes; or why that is not known. */
export async function torqueOff(uid: string, mode: "off" | "brake" = "off"): Promise<string | null> {
  try {
    const body = { mode };
    sheetOf(uid).put(await send("POST", "/servos/{uid}/torque", { path: { uid }, body, timeout_ms: 15_000 }));
    return null;
  } catch (error) {
    return problemText(problemOf(error));
  }
}
