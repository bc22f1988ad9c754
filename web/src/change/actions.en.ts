/** English words of the actions on a whole servo; loaded with them. */

export const words = {
  label: (name: string) => `Actions for ${name}`,
  wiggle: "Wiggle ±3°",
  shortly: "Wiggle",
  wiggleHint:
    "The horn turns 3° to each side, twice, and returns. At most 30\u202frpm and 30\u202f% torque, about 3\u202fs.",
  requesting: "Requesting motion control",
  moving: (at: string) => `Wiggling ±3.0° around ${at}`,
  moved: (low: string, high: string) => `Wiggled from ${low} to ${high}, now back.`,
  notWiggled: (why: string) => `Not wiggled. ${why}`,
  more: "More",
  restart: "Restart…",
  restartLine: "Reloads ROM. Values in RAM only are lost",
  reset: "Factory reset…",
  resetLine: "Sets all values to their defaults, in RAM and ROM",
  checking: "Checking",
  underWay: (n: number) => `A change to ${n === 1 ? "this servo" : "one of these servos"} is in progress.`,
  notRestarted: (why: string) => `Not restarted. ${why}`,
  notReset: (why: string) => `Not reset. ${why}`,
  dismiss: "Dismiss",
};
