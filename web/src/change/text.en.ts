/** English words fetched with the Parameters page: help, confirmation, undo. */

const values = (n: number) => `${n} ${n === 1 ? "value" : "values"}`;

export const words = {
  favourite: (row: string) => `Favourite: ${row}`,
  help: {
    open: (row: string) => `About ${row}`,
    register: "Register",
    raw: "Raw",
    unread: "not read",
    step: "Step",
    stepOf: (step: string) => `${step} each`,
    range: "Range",
    rangeOf: (low: string, high: string) => `${low} to ${high}`,
    standard: "Default",
    section: (number: string) => `section ${number} of the servo's specification`,
    address: (name: string, address: number) => `${name} (index ${address})`,
    afterRestart: "Takes effect after the next restart.",
    keys: "↑ ↓ change by one unit, Shift by ten, Alt by a tenth. Enter confirms. Esc cancels the edit (and stops every servo).",
    unitFollows: (row: string) => `Its unit follows ${row}.`,
    origin: "Reading",
    readAgo: (age: string) => `${age} ago`,
  },

  fold: {
    show: (n: number) => `Show ${n} expert ${n === 1 ? "row" : "rows"}`,
    hide: "Hide",
    what: (names: string) => `Expert rows: ${names}.`,
  },

  confirm: {
    supply: (row: string, wanted: string, reading: string, margin: string) =>
      `${row} ${wanted} could switch the output off immediately: the supply is ${reading} now (±${margin}). With its output off a servo holds nothing, and a load can drop.`,
    temperature: (row: string, wanted: string, reading: string, margin: string) =>
      `${row} ${wanted} could switch the output off immediately: the temperature is ${reading} now (±${margin}). With its output off a servo holds nothing, and a load can drop.`,
    unknown: (row: string, wanted: string) =>
      `${row} ${wanted} could switch the output off immediately: the reading it is compared with is unknown. With its output off a servo holds nothing, and a load can drop.`,
    turns: (row: string, wanted: string, turns: string) =>
      `${row} ${wanted} is ${turns} turns. Beyond ±180° the servo counts turns, and the count is lost at power-off.`,
    ticks: {
      supply: "I checked the supply: this voltage limit is intended",
      temperature: "I checked the temperature: this limit is intended",
      torque_off_in_rom: "Torque off in ROM is intended: the servo holds nothing after a start",
      torque_on_in_rom: "Torque on in ROM is intended: the servo holds its horn after every start",
      multi_turn: "Angles beyond ±180° are intended: the turn count is lost at power-off",
    },
    torqueOff:
      "Torque mode in ROM will be off or brake. After every start the servo holds nothing until torque is turned on.",
    torqueUnknown:
      "The torque mode (0x20) in ROM is unknown, so a save cannot preserve it. Choose the value to save.",
    choices: {
      torque_on_in_rom: "Torque on: the servo holds its horn after every start",
      torque_off_in_rom: "Torque off: the servo holds nothing after a start",
    } as Record<string, string>,
  },

  lost: {
    line: (n: number, at: string) =>
      `${at}: ${values(n)} in RAM ${n === 1 ? "was" : "were"} lost when the servo restarted without a save.`,
    stage: (n: number) => `Stage ${values(n)} again`,
    staged: "Staged again",
  },

  undo: {
    line: (n: number, at: string) => `${at}: ${values(n)} written to RAM.`,
    open: "Undo…",
    dismiss: "Dismiss",
  },
};
