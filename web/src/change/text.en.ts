/** The English sentences of what is fetched with the Parameters page: help, confirmation, undo. */

const values = (n: number) => `${n} ${n === 1 ? "value" : "values"}`;

export const words = {
  favourite: (row: string) => `${row} is a favourite`,
  help: {
    open: (row: string) => `What ${row} does`,
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
    afterRestart: "It takes effect after the next restart.",
    keys: "↑ ↓ one step of the unit, Shift ten, Alt a tenth. Enter keeps, Esc takes the text back (and stops every servo).",
    unitFollows: (row: string) => `Its unit follows ${row}.`,
    origin: "Reading",
    readAgo: (age: string) => `${age} ago`,
  },

  fold: {
    show: (n: number) => `Show ${n} expert ${n === 1 ? "row" : "rows"}`,
    hide: "Fold",
    what: (names: string) => `For experts: ${names}.`,
  },

  confirm: {
    supply: (row: string, wanted: string, reading: string, margin: string) =>
      `${row} ${wanted} could switch the output off at once: the supply is ${reading} now (±${margin}). A servo whose output is off holds nothing; a load can drop.`,
    temperature: (row: string, wanted: string, reading: string, margin: string) =>
      `${row} ${wanted} could switch the output off at once: the temperature is ${reading} now (±${margin}). A servo whose output is off holds nothing; a load can drop.`,
    unknown: (row: string, wanted: string) =>
      `${row} ${wanted} could switch the output off at once: what it is compared with is not known. A servo whose output is off holds nothing; a load can drop.`,
    turns: (row: string, wanted: string, turns: string) =>
      `${row} ${wanted} is ${turns} turns. Beyond ±180° the servo counts turns, and the count is lost at power-off.`,
    ticks: {
      supply: "I checked the supply: this voltage limit is meant",
      temperature: "I checked the temperature: this limit is meant",
      torque_off_in_rom: "Torque off in ROM is intended: the servo holds nothing after a start",
      torque_on_in_rom: "Torque on in ROM is intended: the servo holds its horn after every start",
      multi_turn: "Angles beyond ±180° are intended: the turn count is lost at power-off",
    },
    torqueOff:
      "ROM will hold torque off or brake. After every start the servo holds nothing until torque is turned on.",
    torqueUnknown:
      "What ROM holds as torque mode (0x20) is not known, so a save cannot keep it. Choose what ROM gets.",
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
