/** English words of the Servos page, and of the states of a servo. */

export const servos = {
  title: "Servos",
  known: (known: number, online: number | null) =>
    `${known} known${online === null ? "" : `, ${online} online`}`,
  search: "Label, serial, UID, ID",
  filter: "Show",
  all: (n: number) => `All ${n}`,
  attention: (n: number) => `Needs attention ${n}`,
  unsaved: (n: number) => `Not in ROM ${n}`,
  elsewhere: (n: number) => `Commanded elsewhere ${n}`,
  head: {
    angle: "Angle",
    servo: "Servo",
    ids: "Servo / node ID",
    health: "Health",
    recent: "Last 30 s",
    supply: "Supply",
    age: "Age",
    rom: "ROM",
  },
  saved: "saved",
  notKnown: "not known",
  ramOnly: (n: number) => `${n} in RAM only`,
  ramLost: (n: number) => `${n} RAM ${n === 1 ? "value" : "values"} lost`,
  changedOutside: "Changed externally",
  changedRows: (n: number) => `Changed externally: ${n} ROM ${n === 1 ? "row" : "rows"}`,
  showChanged: "Show the difference…",
  firmware: (version: string) => `fw ${version}`,
  noData: "no data",
  unitConflict: "Status and register 0x08 disagree on the position unit.",
  rename: (name: string) => `Rename ${name}`,
  nickname: "Nickname",
  open: (name: string) => `Open ${name}`,
  unknownModel: "Unknown model",
  unknownLine: "Read-only",
  more: "To add servos, wire them to the bus. They appear here automatically.",
  nothingFound: "No matching servos.",
  showAll: "Show all",
  model: "Model",
  everyModel: "All models",
  list: "List",
  compact: "Compact",
  wall: "3D",
  group: {
    label: "Group",
    none: "Not grouped",
    place: "By label",
    model: "By model",
    state: "By state",
  },
  view: "View",
  sort: {
    label: "Sort",
    none: "Not sorted",
    ascending: "Ascending",
    descending: "Descending",
  },
  sortBy: (column: string) => `Sort by ${column}`,
  select: (name: string) => `Select ${name}`,
  selectAll: "Select all shown",
  bar: {
    label: (n: number) => `${n} ${n === 1 ? "servo" : "servos"} selected`,
    none: "Clear selection",
    plot: "Plot",
    edit: "Compare and edit",
    profile: "Apply profile…",
    /** One servo at a time. */
    wiggling: (name: string, n: number, of: number) =>
      of === 1 ? `Wiggling ${name}` : `Wiggling ${name}, ${n} of ${of}`,
    wiggled: (n: number) => `${n} ${n === 1 ? "servo" : "servos"} wiggled.`,
    skipRest: "Skip remaining",
    notWiggled: (name: string, why: string) => `${name}: not wiggled. ${why}`,
    notRestarted: (name: string, why: string) => `${name}: not restarted. ${why}`,
    torqueOffDone: (n: number) => `Torque is off on ${n} ${n === 1 ? "servo" : "servos"}.`,
    torqueOffFailed: (name: string, why: string) => `${name}: torque off was not confirmed. ${why}`,
  },
  sparkline: (name: string) => `Angle of ${name} over the last 30 s`,
  waiting: "Waiting for a node ID",
  stages: ["1 of 3 parts", "2 of 3 parts", "3 of 3 parts"] as const,
  usually: "Normally up to 1.8\u202fs per servo",
};

export const empty = {
  title: "No servos yet",
  evidence: (fps: string, errors: string) => `The bus carries ${fps} frames/s, ${errors} errors.`,
  noBus: "hornbill is not connected to a bus.",
  supply: "Check the supply: a servo needs its rated voltage to respond.",
  termination: "Check the termination: 120\u202fΩ at both ends of the bus.",
  bitrate: "Check the bit rate: these servos use 1\u202fMbit/s.",
  waiting: "Servos are requesting node IDs. Each takes about a second.",
  lostBus: "The adapter was lost. hornbill reopens it automatically.",
  pick: "Choose the adapter that the servos are wired to.",
  connect: "Connect an adapter…",
  loading: "Loading the list of servos.",
  again: "Check again",
};

export const state = {
  ok: "OK",
  notice: (what: string) => `Notice: ${what}`,
  warning: (what: string) => `Warning: ${what}`,
  failure: (what: string) => `Failure: ${what}`,
  protected: (what: string) => `Protected: ${what}`,
  protectedAt: (celsius: string) => `${celsius}, output off`,
  outputOff: "output off",
  protectedLine: "Output turns on again automatically",
  saving: "Saving to ROM",
  savingLine: "Keep the supply on",
  restarting: "Restarting",
  restartingLine: "No torque for about a second",
  softStart: "Soft start",
  softStartLine: "Horn moves slowly to 0.0°",
  updating: "Software update",
  updatingLine: "Keep the supply on",
  identifying: "Identifying",
  identifyingLine: "Reading model, firmware and serial",
  toSnapshots: "Restore a snapshot…",
  offline: (age: string) => `Offline for ${age}`,
  offlineUnknown: "Offline",
  lastSeen: (at: string) => `Last seen ${at}`,
  checkSupply: "Check its supply",
  connectBus: "Connect the bus",
  neverSeen: "Not seen since hornbill started",
  more: (n: number) => `and ${n} more`,
  unknownBit: (bit: number) => `bit ${bit} (undocumented)`,
  health: {
    warning: "node health is WARNING",
    error: "node health is ERROR",
    critical: "node health is CRITICAL",
  },
  counts: {
    ok: (n: number) => `${n} OK`,
    notice: (n: number) => `${n} ${n === 1 ? "notice" : "notices"}`,
    busy: (n: number) => `${n} busy`,
    warning: (n: number) => `${n} ${n === 1 ? "warning" : "warnings"}`,
    failure: (n: number) => `${n} ${n === 1 ? "failure" : "failures"}`,
    offline: (n: number) => `${n} offline`,
    identifying: (n: number) => `${n} identifying`,
  },
};

const who = (what: string, by: string) => (by === "" ? what : `${what} by ${by}`);

export const activity = {
  holding: "Holding",
  moving: "Moving",
  turning: "Rotating",
  soft_start: "Soft start",
  hunting: "Hunting",
  huntingBy: (swing: string, rate: string | null) =>
    `Hunting${rate === null ? "" : ` at ${rate}`}, ${swing} peak to peak`,
  huntingAdvice: "Oscillates at rest. Lower the P gain or widen the deadband.",
  saturated: "Saturated",
  saturatedAt: (torque: string, limit: string) => `Saturated, torque ${torque} of ${limit}`,
  saturatedAdvice: "Pushes at its torque limit without moving. Free the horn or reduce the load.",
  released: "Torque off: command timeout (0x26)",
  held_after_timeout: "Held after timeout (0x26)",
};

export const output = {
  state: { on: "Output on", off: "Output off", brake: "Brake on", unknown: "Output unknown" },
  reason: {
    configured: () => "as configured",
    stop: (by: string) => who("stopped", by),
    lease: (by: string) =>
      by === "you" ? "your motion control ended" : `motion control${by === "" ? "" : ` of ${by}`} ended`,
    command: (by: string) => `switched by ${by === "" ? "another tool" : by}`,
    timeout: () => "command timeout (0x26)",
    protection: () => "protection",
  },
  restore: "Restore output…",
  offOn: (n: number) => `Output is off on ${n === 1 ? "1 servo" : `${n} servos`}.`,
  keptOn: (n: number) =>
    `Output is on for ${n === 1 ? "1 servo" : `${n} servos`}. It turns off when you leave this page.`,
  nothing: "No servo to restore: torque mode in ROM is off.",
  /** Neither a lease nor a token names the client. */
  client: "a client",
  line: (state: string, why: string) => `${state}: ${why}`,
  at: (why: string, time: string) => `${why}, ${time}`,
};

/** On models and firmware. Notes on firmware come from the server. */
export const model = {
  as: (name: string) => `as ${name}`,
  unknownSeries: (number: string) => `Unknown series ${number}`,
  readOnly: (number: string) =>
    `hornbill does not support series ${number}. It reads this servo, takes snapshots and compares them, ` +
    "but writes nothing except torque off. " +
    "Use a hornbill version that supports the series, or Futaba's own program.",
  otherHardware: (number: string, name: string) =>
    `Hardware ${number} is unknown. hornbill treats this servo as a ${name}, the newest known model of the series.`,
  otherFirmware: (version: string, as: string) =>
    `Firmware ${version} is unknown. hornbill treats it as ${as}, the newest known version before it.`,
  showNote: "Notes on this firmware",
  noteOn: (version: string, note: string) => `Firmware ${version}: ${note}`,
};
