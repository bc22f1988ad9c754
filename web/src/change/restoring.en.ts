/** English words of the dialog that restores outputs; loaded with it. */

const servos = (n: number) => `${n} ${n === 1 ? "servo" : "servos"}`;

export const words = {
  title: (n: number) => `Restore output of ${servos(n)}?`,
  lead: "Outputs come on one after another. Each horn is held where it is now.",
  clears: "The stop is cleared.",
  load: "under load",
  loaded: (names: string, n: number) =>
    `Under load: ${names}. ${n === 1 ? "Its horn takes" : "Their horns take"} up the load as soon as the output is on.`,
  torque: (pct: string) => `about ${pct} torque`,
  stays: (why: string) => `Not restored. ${why}`,
  keeps:
    "The servos' command timeout (0x26) would switch the output off again, so this page takes motion control. The output goes off when you leave this page, hide the tab or turn motion off.",
  again: "Stop was pressed again. Close this and look before you restore the output.",
  go: "Restore output",
  refused: (why: string) => `Output not restored. ${why}`,
  running: "Restoring output",
  done: (n: number) => `Output is on: ${servos(n)}`,
  failed: (on: number, all: number) => `Output is on: ${on} of ${servos(all)}`,
  cleared: "Clear the stop",
  held: (deg: string) => `held at ${deg}`,
  steps: "Steps",
  stop: "Stop ends this at once.",
};
