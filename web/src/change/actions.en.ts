/** The English words for what can be done with a servo as a whole; loaded with it. */

export const words = {
  label: (name: string) => `Actions for ${name}`,
  wiggle: "Wiggle ±3°",
  shortly: "Wiggle",
  wiggleHint:
    "The horn turns by 3° to either side, twice, and back, at most 30\u202frpm and 30\u202f% torque. About 3\u202fs.",
  asking: "Requesting motion control",
  moving: (at: string) => `Wiggling ±3.0° around ${at}`,
  moved: (low: string, high: string) => `Wiggled from ${low} to ${high}, now back.`,
  notWiggled: (why: string) => `Not wiggled. ${why}`,
  more: "More",
  restart: "Restart…",
  restartLine: "Loads ROM again. Values in RAM only are lost",
  reset: "Factory reset…",
  resetLine: "All values to their defaults, in RAM and ROM",
  checking: "Checking",
  underWay: (n: number) => `A change to ${n === 1 ? "this servo" : "one of them"} is under way.`,
  notRestarted: (why: string) => `Not restarted. ${why}`,
  notReset: (why: string) => `Not reset. ${why}`,
  dismiss: "Dismiss",
};
