/** Owns the English sentences of the frame: rail, top bar, Stop, bands, events, keys. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const nav = {
  servos: "Servos",
  commission: "Commission",
  parameters: "Parameters",
  motion: "Motion",
  tune: "Tune",
  faults: "Faults",
  unseen: "not acknowledged",
  bus: "Bus",
  records: "Records",
  label: "Pages",
  on: "on",
  stopped: "stopped",
};

export const theme = { label: "Theme", light: "Light", dark: "Dark", auto: "Auto" };

export const bar = {
  bus: (address: string) => `Bus ${address}`.trim(),
  busLoad: (address: string, load: string) => `Bus ${address}, load ${load}`,
  busState: {
    disconnected: "Not connected",
    connecting: "Connecting",
    active: "Active",
    passive: "Error passive",
    bus_off: "Bus off",
    lost: "Adapter lost",
  },
  bitrate: (mbit: string) => `${mbit}\u202fMbit/s`,
  retry: (word: string, s: number) => `${word}, next try in ${s}\u202fs`,
  load: (pct: string) => `Load ${pct}`,
  loadLimit: (pct: string, cap: string) => `Load ${pct}, limit ${cap}`,
  loadUnknown: "Load not known",
  servos: "Servos",
  noServos: "None yet",
  motion: "Motion control",
  nobody: "Nobody",
  you: "You",
  youFor: (name: string) => `You, ${name}`,
  held: (holder: string, left: number) => `${holder}, ${left}\u202fs left`,
  asks: (by: string, left: number) => `${by} asks, ${left}\u202fs`,
  refused: "Refused: stopped",
};

export const link = {
  lost: (s: number) =>
    `No link to hornbill for ${s}\u202fs. Values are old; controls wait. It reconnects by itself.`,
  up: "Link to hornbill is up",
  down: "No link to hornbill",
};

export const asked = {
  label: "Motion control is asked for",
  asks: (by: string, reason: string) =>
    `${by} asks for motion control${reason ? `: ${reason.replace(/[.\s]+$/, "")}.` : "."}`,
  passes: (left: number) => `It passes in ${left}\u202fs unless you keep it; torque goes off first.`,
  keep: "Keep it",
  hand: "Hand over",
  handed: (by: string) => `Motion ended: handed over to ${by}. Torque is off.`,
};

export const stop = {
  word: "STOP",
  keys: "Esc or Space",
  stopped: "STOPPED",
  again: "Press to send again",
  noLink: "NO LINK",
  cut: "cut the supply",
  label: "Stop: torque off on every servo",
  cause: { button: "Stop button", Esc: "Esc", Space: "Space" },
  unsent: (why: string) => `Stop did not reach hornbill. Cut the supply. ${why}`,
  headline: (at: string, by: string, done: number, all: number, mode: string) => {
    const where = all === 1 ? "its servo" : `${done} of ${all} servos`;
    const what =
      all === 0
        ? "No servo is known."
        : done === all && all > 1
          ? `Torque is ${mode} on all ${all} servos.`
          : done === 0
            ? `No answer yet from ${count(all, "servo", "servos")}.`
            : `Torque is ${mode} on ${where}.`;
    return `Stopped at ${at}${by}. ${what}`;
  },
  by: (who: string) => ` by ${who}`,
  node: (id: number) => `Node ${id}`,
  you: "you",
  silent: (names: string) => `${names} did not answer: if it can move, cut its supply. `,
  silentMany: (names: string) => `${names} did not answer: if they can move, cut their supply. `,
  stays: "Motion stays refused until you clear the stop; clearing moves nothing.",
  first: "First answer after",
  last: "Last answer after",
  repeating: (names: string) => `Repeating to ${names}`,
  clear: "Clear stop…",
  clearTitle: "Clear the stop?",
  clearText: "Nothing moves by this. Torque stays off on every servo until somebody turns it on.",
  unsentPast: "A stop did not reach hornbill. Press Stop again if it is needed.",
  clearSilent: (names: string, many: boolean) =>
    `${names} ${many ? "have" : "has"} not confirmed that torque is off.`,
  clearConfirm: "Clear stop",
  brake: "on the brake",
  off: "off",
  confirmed: (ms: string) => `Torque off, confirmed in ${ms}`,
  noAnswer: "Did not answer the stop",
};

export const lazy = {
  failed:
    "This part of the page could not be loaded. hornbill may have been updated since the page was opened.",
  reload: "Load the page again",
};

export const events = {
  title: "Events",
  all: (n: number) => `All ${count(n, "event", "events")}`,
  none: "No event since this page was opened.",
  hide: "Hide events",
};

export const keys = {
  title: "Keys",
  open: "Keys",
  list: [
    ["Esc", "Stop, everywhere. Closes a dialog too"],
    ["Space", "Stop, unless you type or are on a button"],
    ["?", "These keys"],
    ["/", "Search"],
    ["g s", "Servos"],
    ["g p", "Parameters"],
    ["g m", "Motion"],
    ["g f", "Faults"],
    ["g b", "Bus"],
    ["Ctrl S", "Show the staged changes; never saves"],
    ["Ctrl Z", "Take the last staged edit back"],
    ["← →", "Jog by 1°, when the jog pad has focus. Shift 10°, Alt 0.1°"],
    ["↑ ↓", "Change a number by one unit. Shift ×10, Alt ÷10"],
  ] as const,
};
