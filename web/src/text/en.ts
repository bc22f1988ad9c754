/** Owns the catalogue of everything the page says. Numbers, names and units are slots; a language replaces it whole. */
import type { Problem } from "../api/client";
import * as frame from "./en/frame";
import * as live from "./en/live";
import * as parameters from "./en/parameters";
import * as servos from "./en/servos";

export const text = {
  name: "hornbill",
  on: "On",
  off: "Off",
  cancel: "Cancel",
  close: "Close",
  values: (n: number) => `${n} values`,

  ...frame,
  ...servos,
  ...parameters,
  ...live,

  /** What a refusal of the server means for whoever sits here. */
  problem(problem: Problem): string {
    const facts = problem.facts;
    switch (problem.code) {
      case "lease_held":
        return text.motion.heldBy(String(facts.holder ?? "Somebody else"), facts.expires_in_s);
      case "stopped":
        return text.motion.whileStopped;
      case "no_link":
        return "hornbill does not answer.";
      case "unauthorized":
        return "hornbill wants a token. Open the page with the address it printed.";
      default:
        return problem.message;
    }
  },
};
