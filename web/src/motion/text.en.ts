/** English text of the live panel and the Motion page. */

const seconds = (n: unknown) => Math.max(1, Math.ceil(Number(n)));

export const motion = {
  holder: (n: string) => `Page ${n}`,
  off: (name: string) => `Motion is off for ${name}`,
  enable: (name: string) => `Enable motion for ${name}`,
  what: "This page takes motion control and turns torque on. The horn holds its position; nothing moves until you command it.",
  ends: "Motion ends when you leave this page, hide the tab or lose the link. Torque is then off within 3\u202fs.",
  clear: "First make sure that the horn can turn freely and that no one is near it.",
  requesting: "Requesting motion control",
  heldBy: (holder: string, left: unknown) =>
    `${holder} has motion control for ${seconds(left)}\u202fs more. Request it, or wait.`,
  whileStopped: "Stopped. Clear the stop first, at the top left.",
  whileObserving: "Observer: hornbill sends nothing. Change the role first.",
  whileCommanded: (name: string, node: number) =>
    `${name} is commanded by node ${node}. Stop its commands first.`,
  whileOffline: (name: string) => `${name} is offline. Check its supply.`,
  whileProtected: (name: string) =>
    `${name} is protected: its output is off and turns back on automatically.`,
  whileUnknown: (name: string) => `The series of ${name} is not supported. hornbill does not move it.`,
  whileBusy: (name: string) => `${name} is busy. Wait until it is ready.`,
  bandAll: (names: string) => `Motion is on for ${names}.`,
  dialText: (command: string, angle: string) => `Command ${command}, horn at ${angle}`,
  band: (name: string) => `Motion is on for ${name} only.`,
  bandText:
    "Motion ends when you leave this page, hide the tab or lose the link. Torque is then off within 3\u202fs.",
  turnOff: "Turn motion off",
  dial: "Angle command, drag to move",
  pastLimit: {
    angle_limit_cw: (value: string, limit: string, row: string) =>
      `${value} is beyond the CW angle limit of ${limit} (${row}).`,
    angle_limit_ccw: (value: string, limit: string, row: string) =>
      `${value} is beyond the CCW angle limit of ${limit} (${row}).`,
  },
  outside: (from: string) =>
    `The horn is at ${from}, outside its limits. The first command moves it to the nearest limit or within the limits.`,
  endedByStop: "Motion ended: Stop.",
  stopHidden: "Stop is not fully visible in this window. Enlarge the window or zoom out, then enable motion.",
  endedByHiddenStop: "Motion ended: Stop was no longer fully visible.",
  endedByLink: "Motion ended: the link to hornbill was lost. Torque goes off automatically.",
  endedByHiding: "Motion ended: the tab was hidden.",
  notEnabled: "Motion was not enabled.",
  endedByOther: (holder: string) => `Motion ended: ${holder} took motion control.`,
  endedLease: "Motion ended: motion control was lost.",
  torqueOff: (names: string) => `Torque is off: ${names}.`,
  torqueNotConfirmed: (names: string) =>
    `No response: ${names}. It is not known whether torque is off. hornbill keeps writing torque off until it is acknowledged. If the horn must not move, cut the supply.`,
};
