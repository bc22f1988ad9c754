/** Stop as the page sends it: over the socket and REST at once, without waiting. */

import { signal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import { text } from "../text";
import { stop } from "./bench";
import { problemText } from "./facts";
import { holder } from "./holder";
import { live, up } from "./link";
import { forgetMotion } from "./motion";

export type Cause = "button" | "Esc" | "Space";

/** Codes that the server stores. */
const REASONS: Readonly<Record<Cause, string>> = {
  button: "stop_button",
  Esc: "esc_key",
  Space: "space_key",
};

/** Why the last stop did not reach the server, until a stop does. */
export const unsent = signal<string | null>(null);

/** Torque off on every servo, over the socket and over REST: whichever arrives first. */
export function pressStop(cause: Cause): void {
  const socket = live.send({ type: "stop", mode: "off", by: holder(), reason: REASONS[cause] });
  void callApi("POST", "/stop", {
    query: { by: holder() },
    body: { mode: "off", reason: REASONS[cause] },
    keepalive: true,
    timeout_ms: 5000,
  }).then(
    response => {
      stop.value = response;
      unsent.value = null;
    },
    error => {
      unsent.value = socket && up.peek() ? null : text.stop.unsent(problemText(problemOf(error)));
    },
  );
  forgetMotion(text.motion.endedByStop);
}

/** Clear the stop latch. Moves nothing and turns nothing on. */
export async function clearStop(): Promise<string | null> {
  try {
    stop.value = await callApi("DELETE", "/stop", { query: { by: holder() } });
    return null;
  } catch (error) {
    return problemText(problemOf(error));
  }
}
