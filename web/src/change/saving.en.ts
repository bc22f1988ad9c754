/** English words of a save to ROM, and of the bar before it. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const words = {
  changes: (n: number, name: string) => `${count(n, "change", "changes")} on ${name}`,
  invalid: (n: number) => `${n} invalid ${n === 1 ? "value" : "values"}`,
  parts: (staged: number, ram: number) =>
    [staged > 0 ? `${staged} staged` : "", ram > 0 ? `${ram} in RAM only` : ""].filter(Boolean).join(", "),
  torqueIsOne: " (including torque mode)",
  invalidNever: "Invalid values are never sent.",
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
    softStart: (name: string) => `${name} restarts, horn moves to 0.0°`,
    hold: (name: string) => `${name} restarts, then holds`,
    off: (name: string) => `${name} restarts with torque off`,
    brake: (name: string) => `${name} restarts with the brake on`,
    unknown: (name: string) => `${name} restarts`,
  },
  title: (n: number, name: string) =>
    n === 0 ? `Save ${name} to ROM?` : `Save ${count(n, "value", "values")} to ROM on ${name}?`,
  diffTitle: (n: number, name: string) => `${count(n, "change", "changes")} on ${name}`,
  facts: (model: string, serial: string, id: string) => `${model}, ${serial}, servo ${id}`,
  unknownHead: "The horn may move",
  outputOn:
    "Output is off now. It turns on right before the save and holds the horn in place until the restart.",
  nothing: "ROM already has these values. The servo is saved and restarts anyway.",
  unknownRows: (n: number) =>
    `${count(n, "other value is", "other values are")} saved unchanged: ${n === 1 ? "its ROM value is" : "their ROM values are"} unknown.`,
  idChange: "This changes the servo or node ID. hornbill finds the servo again by its unique ID.",
  head: { parameter: "Parameter", rom: "In ROM now", ram: "In RAM", after: "After" },
  afterSave: (n: number) =>
    n === 1 ? "The servo restarts after the save" : "Each servo restarts after its save",
  free: (n: number) =>
    n === 1
      ? "The horn can turn freely and no one is near it"
      : `The horns of these ${n} servos can turn freely and no one is near them`,
  confirm: (name: string) => `Save and restart ${name}`,
  notSaved: (why: string) => `Not saved: ${why}`,
};
