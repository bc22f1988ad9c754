/** English words of the matrix: many servos side by side. */

const servos = (n: number) => `${n} ${n === 1 ? "servo" : "servos"}`;
const rows = (n: number) => `${n} ${n === 1 ? "row" : "rows"}`;
const values = (n: number) => `${n} ${n === 1 ? "value" : "values"}`;

export const words = {
  title: "Compare and edit",
  servos,
  label: "Parameters of several servos",
  choose: "Choose servos",
  search: "Name or 0x…",
  filter: "Show",
  all: "All",
  differ: (n: number) => `Differ ${n}`,
  changed: (n: number) => `Changed ${n}`,
  keys: "Arrow keys move, Enter edits, Enter again confirms. Esc cancels the edit, and also stops every servo.",
  reading: "Reading parameters.",
  failed: (why: string) => `The parameters could not be read. ${why}`,
  again: "Read again",
  refresh: "Read all from the bus",
  empty: "No servos to show",
  emptyLine:
    "Select servos in the list, then choose Compare and edit. Or connect a bus to show every servo on it.",
  toServos: "Go to Servos",
  none: "No differences and no changes.",
  noneFound: (what: string) => `No parameter matches “${what}”.`,
  expert: "Expert",
  group: (name: string, n: number) => `${name}, ${rows(n)}`,
  absent: "not in this model",
  unread: "not read",
  outlier: (usual: string) => `Differs: the other servos of this model have ${usual}`,
  outlierWord: "differs",
  apart: "Servos of the same model have different values, and none is in the majority",
  staged: (ram: string) => `Staged. RAM: ${ram}`,
  unsaved: "in RAM only",
  cell: (row: string, servo: string, value: string, state: string) =>
    `${row}, ${servo}: ${value}${state === "" ? "" : `, ${state}`}`,
  locked: "Expert row. Unlock it on the servo's own page",
  setAll: (row: string) => `Set ${row} on all servos`,
  setAllWord: "Set all…",
  copy: (name: string) => `Copy ${name} to others`,
  copyWord: "Copy to…",

  set: {
    title: (row: string) => `Set ${row} on several servos`,
    value: "Value",
    who: "Servos",
    now: (value: string) => `now ${value}`,
    refused: (why: string) => `excluded: ${why}`,
    choose: "Choose a value.",
    go: (n: number) => `Stage on ${servos(n)}`,
    line: "Nothing is sent yet. The value is staged for review.",
  },

  copying: {
    title: (name: string) => `Copy ${name} to other servos`,
    who: "Target servos",
    differing: (n: number) => (n === 0 ? "nothing differs" : `${rows(n)} differ`),
    skipped: (n: number) => `${rows(n)} skipped: not allowed or not in this model`,
    skippedLine: "Origin, IDs and torque mode are not copied. Nothing is sent yet: differences are staged.",
    go: (n: number) => `Stage ${values(n)}`,
    otherModel: "another model",
  },

  bar: {
    label: (n: number, m: number) => `${n} ${n === 1 ? "change" : "changes"} on ${servos(m)}`,
    ramOnly: (n: number) => `${values(n)} in RAM only`,
    ramLine: "Lost at power-off. To change more, choose a cell and press Enter.",
    wrong: (n: number) => `${n} invalid ${n === 1 ? "value" : "values"}`,
    never: "Invalid values are never sent.",
    discard: "Discard",
    review: "Review and apply…",
    reviewSub: "Shows the changes first",
    save: "Save all to ROM…",
    saveSub: (n: number) => `${servos(n)} ${n === 1 ? "restarts" : "restart"}`,
  },
};
