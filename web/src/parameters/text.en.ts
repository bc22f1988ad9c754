/** English words of the Parameters page: rows, checks of typed values, jobs. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const params = {
  title: "Parameters",
  choose: "Servo",
  facts: (model: string, serial: string, servo: string, node: string) =>
    `${model}, ${serial}, servo ${servo}, node ${node}`,
  search: "Name or 0x…",
  all: "All",
  changed: (n: number) => `Changed ${n}`,
  favourites: "Favourites",
  filter: "Show",
  head: {
    parameter: "Parameter",
    value: "Value",
    range: "Range of this model",
    ram: "RAM",
    rom: "ROM",
    default: "Default",
  },
  noPwm: "No PWM input",
  live: "Live view",
  reading: "Reading parameters.",
  readAgain: "Read again",
  refresh: "Read all from the bus",
  notRead: (why: string) => `Could not read the parameters: ${why}`,
  toServos: "Go to Servos",
  noneChanged: "No changes.",
  noFavourites: "No favourites yet. Mark a row with ☆.",
  noneFound: (what: string) => `No parameter matches “${what}”.`,
  torqueOff: "Torque off",
  torqueOffFailed: (why: string) => `Torque off was not confirmed: ${why}`,
  unlock: "Unlock",
  locked: "Locked.",
  product: {
    model: "Model",
    serial: "Serial number",
    firmware: "Firmware",
    hardware: "Hardware",
    made: "Produced",
    uid: "Unique ID",
  },
};

export const rows = {
  state: {
    staged: "Staged, not sent",
    pending: "Writing",
    applied: "In RAM, read back. Not in ROM",
    saved: (at: string) => `Saved, verified in ROM ${at}`,
    clamped: (requested: string, holds: string) => `Requested ${requested}, servo has ${holds}`,
    unread: "Not read yet",
    lastRead: (age: string) => `Last read ${age} ago`,
    lastReadUnknown: "Last read before the link was lost",
    noEffect: (why: string) => `No effect now: ${why}.`,
  },
  goTo: (name: string) => `Go to ${name}`,
  use: (value: string) => `Use ${value}`,
  again: "Retry",
  notStaged: "Not staged.",
  notWritten: (why: string) => `Not written: ${why}`,
  ramHolds: (value: string) => `RAM has ${value}.`,
  rolledBack: (others: string) => `Undone: ${others} failed, so all changes were rolled back.`,
  verdict: {
    refused: "the servo refused the value.",
    no_response: "no response after several tries.",
    clamped: "the servo changed the value.",
  } as Record<string, string>,
  staleRevision:
    "Not written: another client changed this servo. Its values were read again. Review them, then apply.",
  ram: "RAM",
  rom: "ROM",
  default: "default",
  toDefault: (row: string, value: string) => `Set ${row} to its default, ${value}`,
  ruler: (ram: string, low: string, high: string) => `RAM value ${ram}, range ${low} to ${high}`,
};

export const check = {
  empty: "No value.",
  notANumber: (typed: string) => `“${typed}” is not a number.`,
  ambiguous: (typed: string) => `The comma in “${typed}” can separate thousands or decimals.`,
  otherUnit: (typed: string, unit: string) =>
    unit === "" ? `This value has no unit. Remove “${typed}”.` : `This value is in ${unit}, not in ${typed}.`,
  enterOne: (value: string) => `Enter ${value}.`,
  above: (value: string, limit: string) => `${value} is above this model's limit of ${limit}.`,
  below: (value: string, limit: string) => `${value} is below this model's limit of ${limit}.`,
  between: (value: string, step: string) => `${value} is not a multiple of ${step}.`,
  either: (low: string, high: string) => `Enter ${low} or ${high}.`,
  enter: (low: string, high: string) => `Enter ${low} to ${high}.`,
  enterNumber: "Enter a number.",
};

export const job = {
  title: (name: string) => `Saving to ROM on ${name}`,
  keepOn: "Keep the supply on until this is done.",
  done: (name: string) => `Saved to ROM on ${name}`,
  doneText: (n: number) => `${count(n, "value", "values")} read back from ROM after the restart.`,
  failed: (name: string) => `Not saved on ${name}`,
  unsure: (name: string) => `Save not verified on ${name}`,
  notConfirmed: (step: string) => `${step}: not confirmed`,
  never: "not reached",
  step: (n: number, all: number) =>
    `Step ${n} of ${all}. Usually 1 to 3\u202fs. It continues if you leave this page.`,
  hide: "Hide",
  close: "Close",
  state: {
    queued: "Waiting",
    running: "Running",
    succeeded: "Done",
    failed: "Failed",
    cancelled: "Cancelled",
  },
  stepState: {
    waiting: "waiting",
    running: "running",
    done: "done",
    failed: "failed",
    skipped: "skipped",
  },
  liveAngle: (angle: string) => `At ${angle} now.`,
};
