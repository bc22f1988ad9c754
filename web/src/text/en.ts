/** The catalogue of everything the page says. Numbers, names and units are slots; a language replaces it whole. */
import type { Problem } from "../api/client";
import * as frame from "../frame/text.en";
import * as live from "../motion/text.en";
import * as parameters from "../parameters/text.en";
import * as servos from "../servos/text.en";

export const text = {
  name: "hornbill",
  on: "On",
  off: "Off",
  cancel: "Cancel",
  close: "Close",
  /** Between the parts of a list. */
  comma: ", ",
  /** Between sentences. */
  period: ". ",
  /** Pages of the documentation, by what somebody wants to do. */
  guides: {
    contents: "Documentation",
    tutorial: "How to: the first servo in ten minutes",
    adapters: "How to connect an adapter",
    commission: "How to commission new servos",
    bus: "How to find out what is wrong with the bus",
    recover: "How to recover a lost servo",
    faults: "What faults and measurements mean",
    profiles: "How to use profiles, clones and history",
    record: "How to record, export and measure",
    rigs: "Rigs: Python, pytest, LabVIEW and others",
    move: "How to move servos from a program",
    socket: "The WebSocket",
    reference: "Every operation",
  },
  docs: "Docs",
  docsLabel: "Docs, in a new tab",
  at: (day: string, time: string) => `${day} ${time}`,
  unread: (why: string) => `This could not be read. ${why}`,
  values: (n: number) => `${n} values`,

  ...frame,
  ...servos,
  ...parameters,
  ...live,

  /** By key, names for what the server's tables name in English already. */
  table: {
    rows: {},
    groups: {},
    choices: {},
    faults: {},
    advice: {},
    firmware: {},
    why: {},
    commands: {},
  } as Readonly<
    Record<
      "rows" | "groups" | "choices" | "faults" | "advice" | "firmware" | "why" | "commands",
      Readonly<Record<string, string>>
    >
  >,

  /** What a refusal of the server means for whoever sits here. */
  problem(problem: Problem): string {
    const facts = problem.facts;
    switch (problem.code) {
      case "lease_held":
        return text.motion.heldBy(String(facts.holder ?? "Somebody else"), facts.expires_in_s);
      case "stopped":
        return text.motion.whileStopped;
      case "bus_disconnected":
        return "No bus is connected. Connect an adapter.";
      case "bus_read_only":
        return "This bus is a recording: nothing is written to it. Connect a real one.";
      case "unknown_servo":
        return "This servo is not known here any more.";
      case "stale_revision":
        return "Somebody else changed this servo meanwhile. Look at what it holds now, then do it again.";
      case "lease_required":
        return "Take motion control first.";
      case "configuration_lost":
        return "The servo lost what it had saved and runs on defaults. Restore a snapshot (Records), or save what it holds now.";
      case "no_link":
        return "hornbill does not answer.";
      case "unauthorized":
        return "hornbill wants a token. Sign in on this page.";
      default:
        return problem.message;
    }
  },
};
