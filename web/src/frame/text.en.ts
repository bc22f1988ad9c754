/** English words of the frame: rail, top bar, Stop, bands, events, keys. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const nav = {
  servos: "Servos",
  commission: "Commission",
  overview: "Overview",
  matrix: "Matrix",
  parameters: "Parameters",
  motion: "Motion",
  tune: "Tune",
  scope: "Scope",
  site: "Site",
  silent: "without contact",
  faults: "Faults",
  unseen: "not acknowledged",
  bus: "Bus",
  recorder: "Recorder",
  records: "Records",
  api: "API",
  more: "More",
  label: "Pages",
  on: "on",
  stopped: "stopped",
};

export const theme = { label: "Theme", light: "Light", dark: "Dark", auto: "Auto" };

export const language = "Language";

export const skip = "Skip to content";

export const bar = {
  bus: (address: string) => `Bus ${address}`.trim(),
  role: { host: "Host", guest: "Guest", observer: "Observer" },
  busLoad: (address: string, load: string) => `Bus ${address}, load ${load}`,
  busState: {
    disconnected: "Not connected",
    connecting: "Connecting",
    active: "Active",
    passive: "Error passive",
    bus_off: "Bus off",
    lost: "Adapter lost",
  },
  over: "Recording ended",
  nothing: "Nothing received",
  bitrate: (mbit: string) => `${mbit}\u202fMbit/s`,
  retry: (word: string, s: number) => `${word}, retry in ${s}\u202fs`,
  load: (pct: string) => `Load ${pct}`,
  loadLimit: (pct: string, cap: string) => `Load ${pct}, limit ${cap}`,
  loadUnknown: "Load unknown",
  servos: "Servos",
  noServos: "None yet",
  motion: "Motion control",
  motionLeft: (left: number) => `Motion control, ${left}\u202fs left`,
  free: "Free",
  you: "You",
  elsewhere: (nodes: string, n: number, you: number, short: boolean) =>
    `Node ${nodes}: ${short ? n : count(n, "servo", "servos")}. You: ${you}`,
  youFor: (name: string) => `You, ${name}`,
  share: (holder: string, n: number, short: boolean) =>
    `${holder}: ${short ? n : count(n, "servo", "servos")}`,
  held: (holder: string, left: number) => `${holder}, ${left}\u202fs left`,
  requested: (by: string, left: number) => `Requested by ${by}, ${left}\u202fs`,
  refused: "Blocked by Stop",
};

export const link = {
  lost: (s: number) =>
    `No link to hornbill for ${s}\u202fs. Values are stale, controls are disabled. Reconnecting…`,
  up: "Connected to hornbill",
  down: "No link to hornbill",
};

/** Failures of the server itself, by code of the doctor's finding. */
export const serverFailure = {
  database: "Changes are not being stored. They are lost if hornbill restarts now.",
  disk_space: "The disk of the data folder is full. Changes and recordings cannot be stored.",
  computer_busy: "hornbill's computer is overloaded. Servos may falsely appear late or offline.",
};

export const request = {
  label: "Motion control requested",
  wants: (by: string, reason: string) =>
    `${by} requests motion control${reason ? `: ${reason.replace(/[.\s]+$/, "")}.` : "."}`,
  passes: (left: number) => `It passes in ${left}\u202fs unless you keep it. Torque turns off first.`,
  keep: "Keep control",
  handOver: "Hand over",
  handedOver: (by: string) => `Motion ended: handed over to ${by}. Torque is off.`,
};

export const stop = {
  word: "STOP",
  /** Which keys stop: while motion is on here, while something moves, while nothing does, after one Esc. */
  keys: { on: "Esc or Space", moving: "Esc", still: "Esc twice", again: "Esc again" },
  reach: (n: number) => (n === 1 ? "1 servo. Acts at once" : `All ${n} servos. Acts at once`),
  stopped: "STOPPED",
  again: "Press to send again",
  noLink: "NO LINK",
  cut: "cut the supply",
  label: "Stop: torque off on every servo",
  unsent: (why: string) => `Stop did not reach hornbill. Cut the supply. ${why}`,
  sendsNothing: "sends nothing",
  benchOnly: (bench: string) => `${bench} only`,
  reaches: (n: number, all: number) => `Reaches ${n} of ${all}, Esc`,
  headline: (at: string, by: string, done: number, all: number, mode: string, reach = "all") => {
    const where = all === 1 ? "the servo" : `${done} of ${all} servos`;
    const what =
      all === 0
        ? ({ none: "Observer: nothing was sent.", own: "hornbill commanded no servo." }[reach] ??
          "No known servos.")
        : done === all && all > 1
          ? `Torque is ${mode} on all ${all} servos.`
          : done === 0
            ? `No response yet from ${count(all, "servo", "servos")}.`
            : `Torque is ${mode} on ${where}.`;
    return `Stopped at ${at}${by}. ${what}`;
  },
  by: (who: string) => ` by ${who}`,
  node: (id: number) => `Node ${id}`,
  you: "you",
  silent: (names: string) => `${names} did not respond: if it can move, cut its supply. `,
  silentMany: (names: string) => `${names} did not respond: if they can move, cut their supply. `,
  stays: "Motion stays blocked until you clear the stop. Clearing moves nothing.",
  first: "First response after",
  last: "Last response after",
  repeating: (names: string) => `Resending to ${names}`,
  happened: "Show what happened",
  clear: "Clear stop…",
  clearTitle: "Clear the stop?",
  clearText: "Clearing moves nothing. Torque stays off on every servo until it is turned on.",
  unsentPast: "A stop did not reach hornbill. Press Stop again if needed.",
  clearSilent: (names: string, many: boolean) =>
    `${names} ${many ? "have" : "has"} not confirmed that torque is off.`,
  clearConfirm: "Clear stop",
  brake: "set to brake",
  off: "off",
  confirmed: (ms: string) => `Torque off, confirmed in ${ms}`,
  noResponse: "No response to the stop",
};

export const missing = {
  page: "No page at this address",
  pageLine: "Check the address or go to the list of servos.",
  servo: "Unknown servo",
  uid: "Unique ID",
  servoLine: "This server has never seen a servo with this unique ID. Check the address or choose a servo.",
};

export const lazy = {
  link: "hornbill cannot be reached, so this part of the page is not loaded yet. It loads when the link is back.",
  updated: "hornbill was updated after this page was opened. Reload to continue.",
  refused: "This part of the page could not be loaded: the server did not deliver it. Retrying.",
  reload: "Reload",
};

export const panel = {
  failed: (why: string) => `This part of the page failed: ${why}. The rest keeps working.`,
  again: "Retry",
};

export const events = {
  title: "Events",
  all: (n: number) => `All ${count(n, "event", "events")}`,
  none: "No events since this page was opened.",
  hide: "Hide events",
};

export const keys = "Shortcuts";
