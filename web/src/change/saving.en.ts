/** The English sentences of a save to ROM, and of what comes before it. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const words = {
  changes: (n: number, name: string) => `${count(n, "change", "changes")} on ${name}`,
  needLook: (n: number) => `${n} ${n === 1 ? "needs" : "need"} a look`,
  parts: (staged: number, ram: number) =>
    [staged > 0 ? `${staged} staged` : "", ram > 0 ? `${ram} in RAM only` : ""].filter(Boolean).join(", "),
  torqueIsOne: " (one is torque mode)",
  invalidNever: "A value that is not allowed is never sent.",
  discard: "Discard",
  diff: "Show diff",
  ctrlS: "Ctrl S",
  ctrlEnter: "Ctrl Enter",
  apply: (n: number) => `Apply ${n} to RAM`,
  applySub: "No restart. Lost at power-off",
  save: "Apply and save to ROM…",
  saveOnly: "Save to ROM…",
  working: { checking: "Checking the save", applying: "Writing to RAM", saving: "Saving to ROM" },
  noLink: "Waiting for the link",
  offline: (name: string) => `${name} is offline`,
  sub: {
    softStart: (name: string) => `${name} restarts, horn goes to 0.0°`,
    hold: (name: string) => `${name} restarts, then holds`,
    off: (name: string) => `${name} restarts with torque off`,
    brake: (name: string) => `${name} restarts on the brake`,
    unknown: (name: string) => `${name} restarts`,
  },
  title: (n: number, name: string) =>
    n === 0 ? `Save ${name} to ROM?` : `Save ${count(n, "value", "values")} to ROM on ${name}?`,
  diffTitle: (n: number, name: string) => `${count(n, "change", "changes")} on ${name}`,
  facts: (model: string, serial: string, id: string) => `${model}, ${serial}, servo ${id}`,
  unknownHead: "The horn may move",
  outputOn:
    "Output is off now. It comes on right before the save, and the horn is held where it is until the restart.",
  nothing: "ROM already holds all of this. The servo is saved and restarts anyway.",
  unknownRows: (n: number) =>
    `${count(n, "other value is", "other values are")} saved as ${n === 1 ? "it is" : "they are"}: what ROM holds of ${n === 1 ? "it" : "them"} is not known.`,
  idChange: "The servo or node ID changes with this. The servo is found again by its unique id.",
  head: { parameter: "Parameter", rom: "In ROM now", ram: "In RAM", after: "After" },
  afterSave: (n: number) =>
    n === 1 ? "The servo restarts after the save" : "Each servo restarts after its save",
  free: (n: number) =>
    n === 1
      ? "The horn can turn freely and nobody is near it"
      : `The horns of these ${n} servos can turn freely and nobody is near them`,
  confirm: (name: string) => `Save and restart ${name}`,
  notSaved: (why: string) => `Not saved: ${why}`,
};
