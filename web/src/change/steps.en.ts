/** What the steps of jobs are called; in English the server says what they found. */
import type { EvidenceCode, Job, StepCode } from "../api/types";
import type { Saying } from "../bench/facts";

const saving = {
  silence: "Silent while it writes and starts",
  restart: "Restarted",
  back: "Back on the bus",
  soft_start: "Soft start over",
};

const steps: Readonly<Record<Job["kind"], Partial<Record<StepCode, string>>>> = {
  save: {
    ...saving,
    check: "At rest, supply and RAM read",
    snapshot: "Snapshot taken",
    write: "Written to ROM",
    read_back: "In ROM: every saved row read back",
  },
  restart: {
    ...saving,
    ask: "Restart asked for",
    silence: "Silent while it starts",
    read_back: "Every row read",
  },
  factory_reset: {
    check: "Supply and RAM read",
    snapshot: "Snapshot taken",
    torque_off: "Torque off",
    erase: "Reset by the servo itself",
    read: "What it holds now read",
    identity: "Identity written back",
    rows: "Rows that still differ written",
    save: "Saved to ROM",
    verify: "Every row verified",
  },
  identify: {
    check: "Horn at rest, torque and limits read",
    limit: "Speed and torque limited",
    wiggle: "Wiggled",
    return: "Back where it was",
    restore: "Everything as it was found",
  },
  step_test: {
    check: "Ready, and what it is measured under recorded",
    there: "Steps out and back",
    numbers: "Numbers made and kept",
  },
  profile: {
    plan: "Values checked",
    write: "Written and read back",
    save: "Saved",
  },
  commissioning: {
    check: "Still holds what was wanted",
    aside: "Servo ID parked on 0, its next owner comes first",
    away: "Node ID parked on dynamic and saved, its next owner comes first",
    identify: "Horn wiggled",
    write: "Named, ids and values written and read back",
    save: "Saved",
    verify: "Found to hold what was wanted",
  },
  restore_output: { clear: "Stop cleared", restore: "output on" },
};

const evidence: Readonly<Partial<Record<EvidenceCode, Saying>>> = {};

export const words = {
  steps,
  evidence,
  /** A step on one of several servos. */
  of: (servo: string, step: string) => `${servo}: ${step}`,
};
