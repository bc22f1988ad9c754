/** The English sentences of the frame: rail, top bar, Stop, bands, events, keys. */

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

export const skip = "Go to the page's content";

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
  over: "Recording over",
  nothing: "Nothing received",
  bitrate: (mbit: string) => `${mbit}\u202fMbit/s`,
  retry: (word: string, s: number) => `${word}, next try in ${s}\u202fs`,
  load: (pct: string) => `Load ${pct}`,
  loadLimit: (pct: string, cap: string) => `Load ${pct}, limit ${cap}`,
  loadUnknown: "Load not known",
  servos: "Servos",
  noServos: "None yet",
  motion: "Motion control",
  motionLeft: (left: number) => `Motion control, ${left}\u202fs left`,
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
  /** Which keys stop: while motion is on here, while something moves, while nothing does, after one Esc. */
  keys: { on: "Esc or Space", moving: "Esc", still: "Esc twice", again: "Esc again" },
  reach: (n: number) => (n === 1 ? "1 servo. Acts at once" : `All ${n} servos. Acts at once`),
  stopped: "STOPPED",
  again: "Press to send again",
  noLink: "NO LINK",
  cut: "cut the supply",
  label: "Stop: torque off on every servo",
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
  happened: "Show what happened",
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

export const missing = {
  page: "No page at this address",
  pageLine: "Check the address, or start from the list of servos.",
  servo: "Unknown servo",
  uid: "Unique ID",
  servoLine:
    "No servo with this unique ID has been seen by this server. Check the address, or choose a servo.",
};

export const lazy = {
  link: "This part of the page is not loaded yet: hornbill cannot be reached. It appears when the connection is back.",
  updated: "hornbill was updated after this page was opened. Reload the page to continue.",
  refused: "This part of the page could not be loaded: the server did not deliver it. Trying again.",
  reload: "Reload",
};

export const panel = {
  failed: (why: string) => `This part of the page failed: ${why}. Everything else goes on.`,
  again: "Show it again",
};

export const events = {
  title: "Events",
  all: (n: number) => `All ${count(n, "event", "events")}`,
  none: "No event since this page was opened.",
  hide: "Hide events",
};

export const keys = "Keys";
