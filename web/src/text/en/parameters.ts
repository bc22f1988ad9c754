/** Owns the English sentences of the Parameters page: rows, save bar, dialogs. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const params = {
  title: "Parameters",
  choose: "Servo",
  facts: (model: string, serial: string, servo: string, node: string) =>
    `${model}, ${serial}, servo ${servo}, node ${node}`,
  search: "Name or 0x…",
  all: "All",
  changed: (n: number) => `Changed ${n}`,
  filter: "Show",
  head: {
    parameter: "Parameter",
    value: "Value",
    range: "Range of this model",
    ram: "RAM",
    rom: "ROM",
    default: "Default",
  },
  noPwm: "PWM input is not in this model",
  live: "Live view",
  reading: "Reading the parameters.",
  readAgain: "Read again",
  refresh: "Read all from the bus",
  notRead: (why: string) => `Parameters not read: ${why}`,
  unknownServo: "This servo is not known here.",
  toServos: "Go to Servos",
  unknownModel: (hardware: string) =>
    `hornbill does not know this model (hardware ${hardware}): nothing is read or written. Update hornbill.`,
  noneChanged: "Nothing is changed here.",
  noneFound: (what: string) => `No parameter matches “${what}”.`,
  torqueOff: "Torque off",
  torqueOffFailed: (why: string) => `Torque off was not confirmed: ${why}`,
  unlock: "Unlock",
  locked: "Locked.",
};

export const rows = {
  state: {
    staged: "Staged, not sent",
    pending: "Writing",
    applied: "In RAM, read back. Not in ROM",
    saved: (at: string) => `Saved, verified in ROM ${at}`,
    clamped: (asked: string, holds: string) => `Asked ${asked}, servo holds ${holds}`,
    unread: "Not read yet",
    lastRead: (age: string) => `Last read ${age} ago`,
    lastReadUnknown: "Last read before the link was lost",
    noEffect: (why: string) => `No effect now: ${why}.`,
  },
  goTo: (name: string) => `Go to ${name}`,
  use: (value: string) => `Use ${value}`,
  again: "Try again",
  notStaged: "Not staged.",
  notWritten: (why: string) => `Not written: ${why}`,
  ramHolds: (value: string) => `RAM holds ${value}.`,
  rolledBack: (others: string) => `Not kept: ${others} failed, so every change was taken back.`,
  verdict: {
    refused: "the servo refused it.",
    no_answer: "no answer in any of the tries.",
    clamped: "the servo changed the value.",
  } as Record<string, string>,
  staleRevision:
    "Not written: somebody else changed this servo meanwhile. Its values were read again; look at them, then apply.",
  ram: "RAM",
  rom: "ROM",
  default: "default",
  ruler: (ram: string, low: string, high: string) => `RAM holds ${ram}, in a range of ${low} to ${high}`,
};

export const check = {
  empty: "No value.",
  notANumber: (typed: string) => `“${typed}” is not a number.`,
  above: (value: string, limit: string) => `${value} is above the ${limit} this model allows.`,
  below: (value: string, limit: string) => `${value} is below the ${limit} this model allows.`,
  between: (value: string, step: string) => `${value} is between two steps of ${step}.`,
  either: (low: string, high: string) => `Enter ${low} or ${high}.`,
  enter: (low: string, high: string) => `Enter ${low} to ${high}.`,
  enterNumber: "Enter a number.",
};

export const save = {
  changes: (n: number, name: string) => `${count(n, "change", "changes")} on ${name}`,
  needLook: (n: number) => `${n} ${n === 1 ? "needs" : "need"} a look`,
  parts: (staged: number, ram: number) =>
    [staged > 0 ? `${staged} staged` : "", ram > 0 ? `${ram} in RAM only` : ""].filter(Boolean).join(", "),
  torqueIsOne: " (one is torque mode)",
  invalidNever: "A value that is not allowed is never sent.",
  discard: "Discard",
  diff: "Show diff",
  ctrlS: "Ctrl S",
  apply: (n: number) => `Apply ${n} to RAM`,
  applySub: "No restart. Lost at power-off",
  save: "Apply and save to ROM…",
  saveOnly: "Save to ROM…",
  working: { applying: "Writing to RAM", saving: "Saving to ROM" },
  noLink: "Waiting for the link",
  offline: (name: string) => `${name} is offline`,
  sub: {
    softStart: (name: string) => `${name} restarts, horn goes to 0.0°`,
    hold: (name: string) => `${name} restarts, then holds`,
    off: (name: string) => `${name} restarts with torque off`,
    brake: (name: string) => `${name} restarts on the brake`,
    unknown: (name: string) => `${name} restarts`,
  },
  title: (n: number, name: string) => `Save ${count(n, "value", "values")} to ROM on ${name}?`,
  diffTitle: (n: number, name: string) => `${count(n, "change", "changes")} on ${name}`,
  facts: (model: string, serial: string, id: string) => `${model}, ${serial}, servo ${id}`,
  moves: (from: string) => `The horn moves: ${from} to 0.0°`,
  movesUnknown: "The horn moves to 0.0°",
  movesWhy:
    "The servo restarts. It holds no torque for about a second, so a load can drop. Then it turns slowly to 0.0°, at most 30\u202frpm and 30\u202f% torque.",
  holds: "The horn stays where it is",
  holdsWhy:
    "The servo restarts. It holds no torque for about a second, so a load can drop. Soft start is off: then it holds where it stands.",
  offHead: "The servo restarts with torque off",
  offWhy:
    "It holds nothing after the restart, nor after any power-on, until torque is turned on. A load can drop.",
  brakeHead: "The servo restarts on the brake",
  brakeWhy:
    "It brakes weakly and does not hold an angle after the restart, nor after any power-on. A load can drop.",
  unknownHead: "The horn may move",
  unknownWhy:
    "The servo restarts. Torque mode or soft start was not read, so what the horn does then is not known.",
  torqueOn: "Torque mode on is saved too: it holds torque after every power-on.",
  turnsLost: (from: string) => `Turn count is lost at the restart: ${from} will read as one turn or less.`,
  idChange: "The servo or node ID changes with this. The servo is found again by its unique id.",
  head: { parameter: "Parameter", rom: "In ROM now", ram: "In RAM", after: "After" },
  free: "The horn can turn freely and nobody is near it",
  confirm: (name: string) => `Save and restart ${name}`,
  notSaved: (why: string) => `Not saved: ${why}`,
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
    `Step ${n} of ${all}. Usually 1 to 3\u202fs. It goes on if you leave this page.`,
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
    skipped: "left out",
  },
  liveAngle: (angle: string) => `At ${angle} now.`,
};
