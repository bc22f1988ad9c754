/** The English sentences of getting motion control from somebody else; loaded with them. */

const seconds = (left: number) => `${Math.max(0, Math.ceil(left))}\u202fs`;

export const words = {
  held: (holder: string) => `${holder} has motion control`,
  left: (left: number) =>
    `It is kept alive, and ends ${seconds(left)} after the last sign of life. While they work, ask for it.`,
  why: "What for (they read it)",
  ask: "Ask for it",
  take: "Take it now…",
  asked: (holder: string) => `${holder} was asked for motion control`,
  passes: (left: number) => `It passes to you in ${seconds(left)} unless they refuse.`,
  withdraw: "Ask no more",
  kept: (holder: string) => `${holder} keeps motion control.`,
  over: "The request has ended. Ask again.",
  takeTitle: (holder: string) => `Take motion control from ${holder}?`,
  takeText: (holder: string) =>
    `Torque goes off on every servo ${holder} commands: a load can drop, and what they do ends at once.`,
  takeWhy: "Why",
  takeNeeds: "Say why: it is kept in the audit, and they read it.",
  takeNow: "Take it now",
  yours: "You have motion control",
  yoursText: "Torque is off on what was commanded before. Nothing moves until you enable motion.",
  giveBack: "Give it back",
};
