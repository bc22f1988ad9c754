/** The English sentences of the live panel and the Motion page. */

const seconds = (n: unknown) => Math.max(1, Math.ceil(Number(n)));

export const motion = {
  holder: (n: string) => `Page ${n}`,
  off: (name: string) => `Motion is off for ${name}`,
  enable: (name: string) => `Enable motion for ${name}`,
  what: "This page takes motion control and turns torque on. The horn holds where it stands; nothing moves before you command it.",
  ends: "Motion ends when you leave this page, hide the tab or lose the link: torque goes off within 3\u202fs.",
  clear: "First make sure that the horn can turn freely and nobody is near.",
  asking: "Taking motion control",
  heldBy: (holder: string, left: unknown) =>
    `${holder} has motion control for ${seconds(left)}\u202fs more. Ask for it, or wait.`,
  whileStopped: "Stopped: clear the stop first. It stands at the top left.",
  whileOffline: (name: string) => `${name} is offline. Check its supply.`,
  whileProtected: (name: string) => `${name} is protected: its output is off and comes back on by itself.`,
  whileUnknown: (name: string) => `hornbill does not know the series of ${name}, and does not move it.`,
  whileBusy: (name: string) => `${name} is busy. Wait until it is ready.`,
  bandAll: (names: string) => `Motion is on for ${names}.`,
  dialText: (command: string, angle: string) => `Command ${command}, horn at ${angle}`,
  band: (name: string) => `Motion is on for ${name} only.`,
  bandText:
    "It ends when you leave this page, hide the tab or lose the link: torque goes off within 3\u202fs.",
  turnOff: "Turn motion off",
  dial: "Angle command, drag to move",
  pastLimit: {
    angle_limit_cw: (value: string, limit: string, row: string) =>
      `${value} is past the CW angle limit of ${limit} (${row}).`,
    angle_limit_ccw: (value: string, limit: string, row: string) =>
      `${value} is past the CCW angle limit of ${limit} (${row}).`,
  },
  outside: (from: string) =>
    `The horn is at ${from}, outside the limits. The first command moves it to the nearest limit or inside.`,
  endedByStop: "Motion ended: stopped.",
  stopHidden: "Stop is not fully visible in this window. Enlarge the window or zoom out, then enable motion.",
  endedByHiddenStop: "Motion ended: Stop was no longer fully visible.",
  endedByLink: "Motion ended: the link to hornbill was lost. Torque goes off by itself.",
  endedByHiding: "Motion ended: the tab was hidden.",
  endedByOther: (holder: string) => `Motion ended: ${holder} has motion control now.`,
  endedLease: "Motion ended: motion control was lost.",
  letGoOff: (names: string) => `Torque is off: ${names}.`,
  letGoSilent: (names: string) =>
    `No answer: ${names}. Whether torque is off there is not known. hornbill writes torque off until it is answered. Take the supply away if the horn must not move.`,
};
