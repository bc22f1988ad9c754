/** English catalogue of words needed by every page. Numbers, names and units are slots. */
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
  /** Pages of the documentation, by task. */
  guides: {
    contents: "Documentation",
    tutorial: "How to: the first servo in ten minutes",
    adapters: "How to connect an adapter",
    commission: "How to commission new servos",
    bus: "How to diagnose the bus",
    recover: "How to recover a lost servo",
    faults: "Faults and measurements",
    tuning: "Tuning: verdicts, plots, Improve",
    profiles: "How to use profiles, copies and history",
    record: "How to record, export and measure",
    rigs: "Rigs: Python, pytest, LabVIEW and others",
    move: "How to move servos from a program",
    socket: "The WebSocket",
    reference: "Every operation",
  },
  docs: "Docs",
  docsLabel: "Docs, in a new tab",
  at: (day: string, time: string) => `${day} ${time}`,
  unread: (why: string) => `Could not load this. ${why}`,
  values: (n: number) => `${n} values`,

  ...frame,
  ...servos,
  ...parameters,
  ...live,

  /** Names by key, empty in English: the server's tables have English names. */
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

  /** A problem of the server in the words of this page. */
  problem(problem: Problem): string {
    const facts = problem.facts;
    switch (problem.code) {
      case "lease_held":
        return text.motion.heldBy(String(facts.holder ?? "Another client"), facts.expires_in_s);
      case "stopped":
        return text.motion.whileStopped;
      case "bus_disconnected":
        return "No bus is connected. Connect an adapter.";
      case "bus_read_only":
        if (facts.cause === "observer_sends_nothing") return text.motion.whileObserving;
        return "This bus is a recording and cannot be written. Connect an adapter.";
      case "unknown_servo":
        return typeof facts.uid === "string" && facts.uid.length < 32
          ? `No servo has the label or serial number ${facts.uid}.`
          : "This servo is no longer known.";
      case "stale_revision":
        return "Another client changed this servo. Review its values, then retry.";
      case "lease_required":
        return "Take motion control first.";
      case "configuration_lost":
        return "The servo lost its saved values and runs on defaults. Restore a snapshot (Records) or save the current values.";
      case "no_link":
        return "hornbill does not respond.";
      case "unauthorized":
        return "A token is required. Sign in on this page.";
      default:
        return problem.message;
    }
  },
};
