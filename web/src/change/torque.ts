/** Torque off without a lease or a question. */
import { problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { sheetOf } from "../bench/parameters";
import { send } from "./send";

/** Null if torque is off or on brake; otherwise why that is unknown. */
export async function torqueOff(uid: string, mode: "off" | "brake" = "off"): Promise<string | null> {
  try {
    const body = { mode };
    sheetOf(uid).put(await send("POST", "/servos/{uid}/torque", { path: { uid }, body, timeout_ms: 15_000 }));
    return null;
  } catch (error) {
    return problemText(problemOf(error));
  }
}
