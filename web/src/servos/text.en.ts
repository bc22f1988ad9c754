/** The English sentences of the Servos page and of what a servo does. */

export const servos = {
  title: "Servos",
  known: (known: number, online: number | null) =>
    `${known} known${online === null ? "" : `, ${online} online`}`,
  search: "Label, serial, uid, ID",
  filter: "Show",
  all: (n: number) => `All ${n}`,
  attention: (n: number) => `Needs attention ${n}`,
  unsaved: (n: number) => `Not in ROM ${n}`,
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
  changedOutside: "Changed outside",
  changedRows: (n: number) => `Changed outside: ${n} ${n === 1 ? "row" : "rows"} of its ROM`,
  showChanged: "Show the difference…",
  firmware: (version: string) => `fw ${version}`,
  noData: "no data",
  unitConflict: "Status and register 0x08 disagree about the position unit.",
  rename: (name: string) => `Rename ${name}`,
  nickname: "Nickname",
  open: (name: string) => `Open ${name}`,
  unknownModel: "Unknown model",
  unknownLine: "Read only",
  more: "More servos: wire them to the bus. They appear here by themselves.",
  nothingFound: "No servo matches.",
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
  selectAll: "Select all that are shown",
  bar: {
    label: (n: number) => `${n} ${n === 1 ? "servo" : "servos"} selected`,
    none: "Select none",
    plot: "Plot",
    edit: "Edit together",
    profile: "Apply profile…",
    /** One servo after the other. */
    wiggling: (name: string, n: number, of: number) =>
      of === 1 ? `Wiggling ${name}` : `Wiggling ${name}, ${n} of ${of}`,
    wiggled: (n: number) => (n === 1 ? "1 wiggled." : `${n} wiggled in turn.`),
    skipRest: "Skip the rest",
    notWiggled: (name: string, why: string) => `${name}: not wiggled. ${why}`,
    notRestarted: (name: string, why: string) => `${name}: not restarted. ${why}`,
    torqueOffDone: (n: number) => `Torque is off on ${n} of them.`,
    torqueOffFailed: (name: string, why: string) => `${name}: torque off was not confirmed. ${why}`,
  },
  sparkline: (name: string) => `Angle of ${name} over the last 30 s`,
  waiting: "Waiting for a node ID",
  stages: ["heard", "2 of 3 parts", "third part"] as const,
  usually: "Normal: up to 1.8\u202fs per servo",
};

export const empty = {
  title: "No servo yet",
  evidence: (fps: string, errors: string) => `The bus carries ${fps} frames/s with ${errors} errors.`,
  noBus: "hornbill is not connected to a bus.",
  supply: "Check the supply: a servo needs its rated voltage before it answers.",
  termination: "Check the termination: 120\u202fΩ at both ends of the bus.",
  bitrate: "Check the bit rate: these servos talk at 1\u202fMbit/s.",
  waiting: "Servos are asking for a node ID; it takes about a second each.",
  lostBus: "The adapter is lost. It is opened again by itself.",
  pick: "Pick the adapter the servos are wired to; hornbill lists what is plugged in.",
  connect: "Connect an adapter…",
  loading: "Reading the list of servos.",
  again: "Look again",
};

export const state = {
  ok: "OK",
  notice: (what: string) => `Notice: ${what}`,
  warning: (what: string) => `Warning: ${what}`,
  failure: (what: string) => `Failure: ${what}`,
  protected: (what: string) => `Protected: ${what}`,
  protectedAt: (celsius: string) => `${celsius}, output off`,
  outputOff: "output off",
  protectedLine: "Output comes back on by itself",
  saving: "Saving to ROM",
  savingLine: "Keep its supply on",
  restarting: "Restarting",
  restartingLine: "Holds no torque for about a second",
  softStart: "Soft start",
  softStartLine: "Horn goes slowly to 0.0°",
  updating: "Software update",
  updatingLine: "Keep its supply on",
  identifying: "Identifying",
  identifyingLine: "Reading model, firmware and serial",
  toSnapshots: "Restore a snapshot…",
  offline: (age: string) => `Offline for ${age}`,
  offlineUnknown: "Offline",
  lastSeen: (at: string) => `Last seen ${at}`,
  checkSupply: "Check its supply",
  connectBus: "Connect the bus",
  neverSeen: "Not heard since hornbill started",
  more: (n: number) => `and ${n} more`,
  unknownBit: (bit: number) => `bit ${bit} (undocumented)`,
  health: {
    warning: "it reports a warning",
    error: "it reports an error",
    critical: "it reports a critical state",
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
  turning: "Turning",
  soft_start: "Soft start",
  hunting: "Hunting",
  huntingBy: (swing: string) => `Hunting, ${swing} peak to peak`,
  huntingAdvice: "It oscillates at rest. Lower the P gain or widen the dead band.",
  saturated: "Saturated",
  saturatedAt: (torque: string, limit: string) => `Saturated, torque ${torque} of ${limit}`,
  saturatedAdvice: "It pushes at its torque limit without moving. Free the horn or reduce the load.",
  released: "Let go: command timeout (0x26)",
  held_after_timeout: "Held after timeout (0x26)",
};

export const output = {
  state: { on: "Output on", off: "Output off", brake: "Brake on", unknown: "Output not known" },
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
    `Output is on for ${n === 1 ? "1 servo" : `${n} servos`}. It goes off when you leave this page.`,
  nothing: "No servo to restore: the torque mode in ROM is off.",
  /** Neither motion control nor a token told who it was. */
  client: "a client",
  line: (state: string, why: string) => `${state}: ${why}`,
  at: (why: string, time: string) => `${why}, ${time}`,
};

/** On models and firmware; the notes on firmware are the server's. */
export const model = {
  as: (name: string) => `as ${name}`,
  unknownSeries: (number: string) => `Unknown series ${number}`,
  readOnly: (number: string) =>
    `hornbill does not know series ${number}: this servo can be read, kept as a snapshot and compared. ` +
    "It is neither moved nor written to, but for torque off. " +
    "Use a hornbill that knows this series, or Futaba's own program.",
  otherHardware: (number: string, name: string) =>
    `hornbill does not know hardware ${number}: it treats this servo as a ${name}, the newest it knows of the series.`,
  otherFirmware: (version: string, as: string) =>
    `hornbill does not know firmware ${version}: it treats it as ${as}, the newest before it.`,
  showNote: "What to know of this firmware",
  noteOn: (version: string, note: string) => `Firmware ${version}: ${note}`,
};
