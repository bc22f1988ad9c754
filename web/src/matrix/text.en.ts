/** The English sentences of the matrix, many servos side by side, and of choosing a profile for several. */

const servos = (n: number) => `${n} ${n === 1 ? "servo" : "servos"}`;
const rows = (n: number) => `${n} ${n === 1 ? "row" : "rows"}`;
const values = (n: number) => `${n} ${n === 1 ? "value" : "values"}`;

export const words = {
  title: "Edit together",
  servos,
  label: "Parameters of several servos",
  choose: "Choose servos",
  search: "Name or 0x…",
  filter: "Show",
  all: "All",
  differ: (n: number) => `Differ ${n}`,
  changed: (n: number) => `Changed ${n}`,
  keys: "Arrow keys move, Enter edits, Enter again keeps. Esc takes the text back, and stops every servo, too.",
  reading: "Reading the parameters.",
  failed: (why: string) => `The parameters could not be read. ${why}`,
  again: "Read again",
  refresh: "Read all from the bus",
  nobody: "No servo to show",
  nobodyLine:
    "Choose servos in the list, then Edit together. Or connect a bus: every servo on it is shown here.",
  toServos: "Go to Servos",
  none: "Nothing differs and nothing is changed here.",
  noneFound: (what: string) => `No parameter matches “${what}”.`,
  expert: "Expert",
  group: (name: string, n: number) => `${name}, ${rows(n)}`,
  absent: "not in this model",
  unread: "not read",
  outlier: (usual: string) => `Differs: the others of this model hold ${usual}`,
  outlierWord: "differs",
  apart: "The servos of one model hold different values, none of them most of the time",
  staged: (ram: string) => `Staged. RAM holds ${ram}`,
  unsaved: "in RAM only",
  cell: (row: string, servo: string, value: string, state: string) =>
    `${row}, ${servo}: ${value}${state === "" ? "" : `, ${state}`}`,
  locked: "Expert row: unlock it on the servo's own page",
  setAll: (row: string) => `Set ${row} on all servos`,
  setAllWord: "Set all…",
  copy: (name: string) => `Copy ${name} to others`,
  copyWord: "Copy to…",

  set: {
    title: (row: string) => `Set ${row} on several servos`,
    value: "Value",
    who: "On these servos",
    now: (value: string) => `holds ${value}`,
    refused: (why: string) => `left out: ${why}`,
    choose: "Choose a value.",
    go: (n: number) => `Stage on ${servos(n)}`,
    line: "Nothing is sent yet: it is staged, to be looked at and applied.",
  },

  copying: {
    title: (name: string) => `Copy ${name} to other servos`,
    who: "To these servos",
    differing: (n: number) => (n === 0 ? "nothing differs" : `${rows(n)} differ`),
    skipped: (n: number) => `${rows(n)} left out: not allowed or not there in this model`,
    kept: "Origin, IDs and torque mode stay as they are. Nothing is sent yet: what differs is staged.",
    go: (n: number) => `Stage ${values(n)}`,
    otherModel: "another model",
  },

  bar: {
    label: (n: number, m: number) => `${n} ${n === 1 ? "change" : "changes"} on ${servos(m)}`,
    ramOnly: (n: number) => `${values(n)} in RAM only`,
    ramLine: "Lost when the supply goes off. To change more, choose a cell and press Enter.",
    wrong: (n: number) => `${n} ${n === 1 ? "needs" : "need"} a look`,
    never: "A value that is not allowed is never sent.",
    discard: "Discard",
    review: "Look over and apply…",
    reviewSub: "Shows the changes first",
    save: "Save all to ROM…",
    saveSub: (n: number) => `${servos(n)} ${n === 1 ? "restarts" : "restart"}`,
  },
};
