/** English text of the Faults page; loaded with it. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const words = {
  title: "Faults",
  summary: (now: number, unseen: number) =>
    now === 0 && unseen === 0
      ? "No active faults"
      : `${count(now, "active fault", "active faults")}, ${unseen} not acknowledged`,
  servo: "Servo",
  all: "All servos",
  ackAll: "Acknowledge all",
  ack: "Acknowledge",
  ackOf: (label: string, name: string) => `Acknowledge: ${label} of ${name}`,
  now: "Active",
  past: "Past",
  noneNow: "These servos have no active faults.",
  nonePast: "No past faults.",
  level: { failure: "Failure", warning: "Warning", notification: "Notice" },
  latched: "Stays until power-off",
  latchedWhy: "It does not clear when its cause is gone. Only a restart clears it.",
  pastEvent: "Before the last start",
  pastEventWhy: "Reports an event before the servo started, not its present state.",
  stale: "State unknown",
  staleWhy: "Last state the servo reported. It does not respond now, so its present state is unknown.",
  over: "Cleared",
  first: "First",
  last: "Last seen",
  count: (n: number) => (n === 1 ? "once" : `${n} times`),
  seenBy: (who: string, at: string) => `Acknowledged by ${who}, ${at}`,
  emptyTitle: "No faults so far",
  emptyText:
    "Each servo can report 32 failures, 32 warnings and 32 notices, and hornbill reads them continuously. Faults appear here with their meaning and remedy. After they clear, they stay in the list of past faults.",
  emptyLive: (servos: number, read: number) =>
    `${count(servos, "known servo", "known servos")}, ${read} read.`,
  toServos: "Go to Servos",
  acknowledgeText:
    "Acknowledging a fault records that it has been seen. It does not clear the fault in the servo: a fault clears when its cause is gone, or at a restart.",
  loading: "Loading faults.",
  failed: (why: string) => `Some faults could not be read or acknowledged. ${why}`,
  open: (name: string) => `Open ${name}`,
};
