/** English words of requesting or taking motion control from another holder; loaded with them. */

const seconds = (left: number) => `${Math.max(0, Math.ceil(left))}\u202fs`;

export const words = {
  held: (holder: string) => `${holder} has motion control`,
  left: (left: number) =>
    `Control expires ${seconds(left)} after their last heartbeat. If they are still working, request it.`,
  why: "Reason (shown to the current holder)",
  request: "Request control",
  take: "Take control now…",
  requested: (holder: string) => `Motion control requested from ${holder}`,
  passes: (left: number) => `It passes to you in ${seconds(left)} unless they refuse.`,
  withdraw: "Cancel request",
  refused: (holder: string) => `${holder} keeps motion control.`,
  over: "The request has ended. Request control again.",
  takeTitle: (holder: string) => `Take motion control from ${holder}?`,
  takeText: (holder: string) =>
    `Torque turns off on every servo that ${holder} commands: a load can drop, and their work ends at once.`,
  takeWhy: "Reason",
  takeNeeds: "Enter a reason. It is stored in the audit and shown to them.",
  takeNow: "Take control now",
  yours: "You have motion control",
  yoursText: "Torque is off on the servos commanded before. Nothing moves until you enable motion.",
  release: "Release control",
};
