/** English words of changes to servos: the dialog before a change, its progress and result; loaded with them. */
import type { ChangeKind } from "./flow";

const values = (n: number) => `${n} ${n === 1 ? "value" : "values"}`;
const counted = (n: number, one: string) => `${n} ${one}${n === 1 ? "" : "s"}`;
const servos = (n: number) => counted(n, "servo");

/** Subject of a change. */
export interface About {
  /** Name of the servo or profile. */
  name: string;
  servos: number;
  values: number;
  save: boolean;
}

type Sentence = (about: About) => string;

interface Kind {
  title: Sentence;
  lead?: string;
  head?: { now: string; next: string };
  nothing?: string;
  /** Label of the check box that includes a save, and the line shown while it is not checked. */
  save?: string;
  ram?: string;
  go: Sentence;
  running?: Sentence;
  done?: Sentence;
  failed?: Sentence;
  other?: string;
}

const them = ({ servos: n, name }: About) => (n === 1 ? name : servos(n));

const kinds: Record<ChangeKind, Kind> = {
  apply: {
    title: ({ name }) => `Confirm changes to ${name}`,
    lead: "Nothing was written.",
    go: ({ values: n }) => `Write ${values(n)} anyway`,
  },
  save: {
    title: ({ name, values: n }) =>
      n === 0 ? `Save ${name} to ROM?` : `Save ${values(n)} to ROM on ${name}?`,
    nothing: "ROM already has these values. The servo is saved and restarts anyway.",
    go: ({ name }) => `Save and restart ${name}`,
    running: ({ name }) => `Saving to ROM on ${name}`,
    done: ({ name }) => `Saved to ROM on ${name}`,
    failed: ({ name }) => `Not saved on ${name}`,
  },
  undo: {
    title: ({ name, values: n }) => `Restore ${values(n)} on ${name}?`,
    lead: "RAM had these values before. They are written to RAM and read back; ROM does not change.",
    head: { now: "Now", next: "Before" },
    go: ({ values: n }) => `Restore ${values(n)}`,
  },
  snapshot: {
    title: ({ name }) => `Restore ${name}`,
    nothing: "No changes: the servo already has these values.",
    save: "Also save to ROM. The servo restarts: no torque for about a second, and its horn may move slowly to 0°",
    ram: "RAM only: lost at power-off.",
    go: ({ values: n, save }) => `Write ${values(n)}${save ? " and save" : ""}`,
  },
  drift: {
    title: ({ name }) => `Another tool changed ${name}`,
    lead: "ROM differs from the values hornbill last read: another computer or tool wrote it.",
    head: { now: "Found", next: "Known before" },
    nothing: "No differences remain.",
    save: "Save to ROM. The servo restarts: no torque for about a second, and its horn may move slowly to 0°",
    ram: "RAM only: the mark remains until ROM is verified.",
    go: ({ values: n }) => `Restore ${values(n)}`,
    other: "Accept found values",
  },
  batch: {
    title: ({ servos: n }) => `Apply to ${servos(n)}?`,
    save: "Also save to ROM: each of these servos restarts",
    ram: "RAM only: no restart. Lost at power-off.",
    go: ({ servos: n, save }) => `Apply ${save ? "and save" : "to"} ${servos(n)}`,
    running: ({ servos: n }) => `Applying to ${servos(n)}`,
    done: ({ servos: n }) => `Applied to ${servos(n)}`,
    failed: ({ servos: n }) => `Not applied to ${servos(n)}`,
  },
  "batch-save": {
    title: ({ servos: n }) => `Save ${servos(n)} to ROM?`,
    nothing: "ROM already has these values. The servo is saved and restarts anyway.",
    go: ({ servos: n }) => `Save and restart ${servos(n)}`,
    running: ({ servos: n }) => `Saving ${servos(n)} to ROM`,
    done: ({ servos: n }) => `${servos(n)} saved`,
    failed: ({ servos: n }) => `${servos(n)} not saved`,
  },
  profile: {
    title: ({ name }) => `Apply ${name}`,
    save: "Save to ROM. Each servo restarts: no torque for about a second, and its horn may move slowly to 0°",
    go: ({ servos: n }) => `Apply to ${servos(n)}`,
    running: ({ name }) => `Applying ${name}`,
    done: ({ name }) => `${name} applied`,
    failed: ({ name }) => `${name} not applied to all`,
  },
  restart: {
    title: about => `Restart ${them(about)}?`,
    head: { now: "In RAM now", next: "After, from ROM" },
    nothing: "No values are lost: RAM matches the known ROM values.",
    go: about => `Restart ${them(about)}`,
    running: about => `Restarting ${them(about)}`,
    done: about => `${them(about)} restarted`,
    failed: about =>
      about.servos === 1 ? `Restart of ${about.name} not confirmed` : `${them(about)} not restarted`,
  },
  "factory-reset": {
    title: ({ name }) => `Reset ${name} to factory defaults?`,
    head: { now: "Now", next: "Default" },
    nothing: "All values are already at their defaults. The servo is written and restarted anyway.",
    go: ({ name }) => `Reset ${name}`,
    running: ({ name }) => `Resetting ${name}`,
    done: ({ name }) => `${name} is at factory defaults`,
    failed: ({ name }) => `${name} was not reset`,
  },
  output: {
    title: ({ servos: n }) => `Restore output of ${servos(n)}?`,
    go: () => "Restore output",
    running: () => "Restoring output",
    done: ({ servos: n }) => `Output is on: ${servos(n)}`,
    failed: () => "Output not restored on all servos",
  },
  plan: {
    title: ({ name }) => `Run ${name}?`,
    go: ({ servos: n }) => `Move ${servos(n)}`,
    running: ({ name }) => `Running ${name}`,
    done: ({ name }) => `${name}: all within limits`,
    failed: ({ name }) => `${name} has ended early or exceeded a limit`,
  },
  "plan-resume": {
    title: ({ name }) => `Resume ${name}?`,
    lead: "The run continues with the cycle and step at which it ended. Its results are kept.",
    go: () => "Resume and move",
    running: ({ name }) => `Running ${name}`,
    done: ({ name }) => `${name}: all within limits`,
    failed: ({ name }) => `${name} has ended early or exceeded a limit`,
  },
};

export const words = {
  kinds,
  parameter: "Parameter",
  now: "Now",
  next: "New value",
  planning: "Checking the changes",
  again: "Check again",
  preview: "Preview changes",
  nothing: "No changes.",
  unchanged: (n: number) => `${values(n)} unchanged.`,
  leftOut: (n: number) => `${values(n)} skipped`,
  rejected: (why: string) => `Excluded, nothing is written: ${why}`,
  refused: (why: string) => `Nothing was written. ${why}`,
  facts: (model: string, serial: string, id: string) => `${model}, ${serial}, servo ${id}`,
  plan: {
    size: (cycles: number, steps: number, least: string) =>
      `${counted(cycles, "cycle")} of ${counted(steps, "step")}, at least ${least} plus the moves.`,
    moves: "Torque turns on, the servos move, and torque turns off at the end. Keep clear of the horns.",
    stepsLabel: "Steps of a cycle",
    profile: (name: string) => `Profile ${name} is written to RAM first.`,
    limits: (list: string) => `Limits: ${list}.`,
    onLimit: {
      stop: "A servo beyond a limit ends the run.",
      drop: "Torque turns off on a servo beyond a limit; the others continue.",
      continue: "A servo beyond a limit is recorded and continues.",
    },
    quantity: {
      error: "position error",
      temperature: "temperature",
      torque: "torque",
      least: "supply at least",
      most: "supply at most",
    },
    cycles: (done: number, all: number) => `${done} of ${counted(all, "cycle")} done`,
    progress: "Progress of the run",
    end: "End run",
    resume: "Resume…",
    report: "Report",
    alone: "The server runs the plan, also if this page is closed. Stop and End run turn torque off.",
  },
  keepOn: "Keep the supply on until this is done.",
  inTurn: "One servo at a time, in this order. Keep this page open until the last one has restarted.",
  lost: (n: number) => `${values(n)} in RAM only ${n === 1 ? "is" : "are"} lost`,
  lostHint: "To keep them, cancel and save to ROM first.",
  assumed: "found in RAM after an unobserved restart",
  working: "Writing",
  show: "Show progress",
  of: (done: number, all: number) => `${done} of ${all} done`,
  steps: (name: string) => `Steps of ${name}`,
  results: "Results by servo",
  state: {
    waiting: "Waiting",
    running: "Running",
    done: "Done",
    failed: "Failed",
    left_out: "Not started",
  },
  written: (n: number) => `${values(n)} written and read back`,
  writtenSaved: (n: number) => `${values(n)} written, saved, and read back from ROM`,
  saved: "Saved, and read back from ROM",
  fault: {
    not_written: (why: string) => `Not written: ${why}`,
    rolled_back: (why: string) => `Not written; this servo is unchanged. ${why}`,
    not_saved: (why: string) => `Written to RAM, not saved. ${why}`,
  },

  /** Torque until the restart. */
  gap: {
    save: "The servo writes to ROM and restarts. It has no torque for about a second, so a load can drop.",
    restart: "The servo has no torque for about a second, so a load can drop.",
    "factory-reset": "Torque turns off first and stays off for a few seconds, so a load can drop.",
  },
  /** Movement of the horn at the start, by the code of the forecast; then after it. */
  horn: {
    moves: (from: string) => `The horn moves: ${from} to 0.0°`,
    unknown_start: "The horn moves to 0.0°",
    stays: "The horn stays at 0.0°",
    holds: "The horn stays in place",
    no_torque: "The servo restarts with torque off",
    brake: "The servo restarts with the brake on",
    unknown: "The horn may move to 0.0°",
  },
  after: {
    moves: "Then it turns slowly to 0.0°, at most 30\u202frpm and 30\u202f% torque.",
    unknown_start:
      "Then it turns slowly to 0.0° from an unknown angle: origin or direction change with the restart.",
    stays: "Then it holds within 1° of 0.0°.",
    holds: "Soft start is off: then it holds its position.",
    no_torque: "After the restart it holds nothing until torque is turned on.",
    brake: "After the restart it brakes weakly and holds no angle.",
    unknown: "ROM was not read completely, so the horn's movement is unknown.",
  },
  /** By the code of the warning. The other warnings are covered by the sentences above, or concern only a save. */
  warnings: {
    turn_count_lost: (before: string, after: string) =>
      `The turn count is lost: ${before} will read as ${after}. The next move may go the other way.`,
    rom_lost: () =>
      "Its saved values could not be loaded at the last start. If they cannot be loaded this time, it runs on defaults again. Restore a snapshot and save.",
    timeout_during_soft_start: (after: string) =>
      `Its command timeout (0x26, 0x27) may switch the output off ${after} after the start. The horn then coasts to rest.`,
    energised: () =>
      "The output turns on briefly before ROM is written and holds the horn in place. Keep clear.",
    outside_limits: (here: string, limit: string) =>
      `The horn is at ${here}, outside its angle limits. It may move to ${limit}.`,
    supply_near_limit: (supply: string, limit: string) =>
      `The supply is ${supply}, close to the limit of ${limit}. It must not sag while ROM is written.`,
    supply_unknown: () => "The supply was not read. It must be steady while ROM is written.",
    supply_beyond_limit: (supply: string) =>
      `The supply is ${supply}, beyond a limit that applies after the restart. The output then stays off.`,
  },

  reset: {
    keep: (id: string, node: string, origin: string) => `Keep servo ID ${id}, ${node} and origin ${origin}`,
    node: (id: string) => `node ID ${id}`,
    dynamicNode: "dynamic node ID",
    identityGoes:
      "The servo gets servo ID 0 and a dynamic node ID, and its origin may change. hornbill finds it again by its unique ID.",
    changes: (n: number) => `${values(n)} ${n === 1 ? "changes" : "change"} in RAM and ROM`,
    snapshot: "A snapshot of the current values is taken first.",
    type: (name: string) => `Type ${name} to confirm`,
  },

  profile: {
    who: "Servos",
    none: "No servos on the bus.",
    goOn: "Continue with the others if one fails",
    planned: (n: number) => (n === 0 ? "no changes" : `${values(n)} ${n === 1 ? "changes" : "change"}`),
  },

  output: {
    lead: "Outputs turn on one after another. Each horn is held at its current angle.",
    clears: "The stop is cleared.",
    load: "under load",
    loaded: (names: string, n: number) =>
      `Under load: ${names}. ${n === 1 ? "Its horn takes" : "Their horns take"} up the load as soon as the output is on.`,
    torque: (pct: string) => `about ${pct} torque`,
    stays: (why: string) => `Not restored. ${why}`,
    keeps:
      "The servos' command timeout (0x26) would switch the output off again, so this page takes motion control. The output turns off when you leave this page, hide the tab or turn motion off.",
    again: "Stop was pressed again. Close this and check before you restore the output.",
    cleared: "Clear the stop",
    held: (deg: string) => `held at ${deg}`,
    stop: "Stop ends this immediately.",
  },

  /** Choice of a profile. */
  profiles: {
    title: (n: number) => `Apply a profile to ${servos(n)}`,
    facts: (model: string, n: number) => `${model}, ${n} ${n === 1 ? "row" : "rows"}`,
    toProfiles: "Go to Profiles",
    loading: "Loading profiles.",
    empty: "No profiles yet",
    emptyLine:
      "Configure one servo, then create a profile from it. It contains the servo's values, but not its IDs and origin. Or import a TOML or JSON file.",
    anyModel: "any model",
  },

  /** File formats of a job's report. */
  report: {
    csv: "CSV",
    json: "JSON",
    junit: "JUnit",
    html: "Print",
  },
};
