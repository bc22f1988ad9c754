/** Torque off without motion control: it needs no lease and asks nothing. */
import { problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { sheetOf } from "../bench/parameters";
import { send } from "./send";

/** Null when torque is off, or why that is not known. */
export async function torqueOff(uid: string): Promise<string | null> {
  try {
    const body = { mode: "off" } as const;
    sheetOf(uid).put(await send("POST", "/servos/{uid}/torque", { path: { uid }, body, timeout_ms: 15_000 }));
    return null;
  } catch (error) {
    return problemText(problemOf(error));
  }
}
