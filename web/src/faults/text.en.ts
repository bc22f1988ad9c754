/** The English sentences of the Faults page; loaded with it. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const words = {
  title: "Faults",
  summary: (now: number, unseen: number) =>
    now === 0 && unseen === 0
      ? "Nothing wrong now"
      : `${count(now, "fault", "faults")} now, ${unseen} not acknowledged`,
  servo: "Servo",
  all: "All servos",
  ackAll: "Acknowledge all",
  ack: "Acknowledge",
  ackOf: (label: string, name: string) => `Acknowledge: ${label} of ${name}`,
  now: "Now",
  past: "Past",
  noneNow: "Nothing is wrong with these servos now.",
  nonePast: "Nothing else was ever seen.",
  level: { failure: "Failure", warning: "Warning", notification: "Notice" },
  latched: "Stays until power-off",
  latchedWhy: "It does not go by itself, whatever its cause does: only a restart ends it.",
  pastEvent: "Before its last start",
  pastEventWhy: "It tells of something that happened before the servo started, not of now.",
  stale: "Not known now",
  staleWhy: "The servo said so last. It is silent now, so nobody knows whether it still is so.",
  over: "Over",
  first: "First",
  last: "Last",
  count: (n: number) => (n === 1 ? "once" : `${n} times`),
  seenBy: (who: string, at: string) => `Acknowledged by ${who}, ${at}`,
  emptyTitle: "No fault was ever seen",
  emptyText:
    "Each servo tells of 32 failures, 32 warnings and as many notices; hornbill asks for them all the time. What comes up stands here with what it means and what to do, and stays in the list of past faults after it has gone.",
  emptyLive: (servos: number, read: number) =>
    `${count(servos, "servo", "servos")} on the bus or known, ${read} read.`,
  toServos: "Show the servos",
  acknowledgeText:
    "Acknowledging says that somebody has seen it. It clears nothing in the servo: a fault goes when its cause does, or at a restart.",
  loading: "Reading the faults.",
  failed: (why: string) => `Some faults could not be read or acknowledged. ${why}`,
  again: "Try again",
  open: (name: string) => `Open ${name}`,
};
