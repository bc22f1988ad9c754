/** English words of connection roles. */
const servos = (n: number) => (n === 1 ? "1 servo" : `${n} servos`);

export const words = {
  name: { host: "Host", guest: "Guest", observer: "Observer", auto: "Automatic" },
  means: {
    auto: "Listen for 1.5\u202fs first. Guest beside an autopilot or another allocator, otherwise host.",
    host: "The only program that configures and commands servos. Allocates node IDs.",
    guest:
      "Beside an autopilot. Allocates no node IDs, reads at most 200\u202fframes/s, and moves only servos that no other node commands.",
    observer: "Sends not a single frame: no reads, no commands, no Stop.",
  },
  label: "Connection role",
  remembered: "The role is remembered for this adapter.",
  title: "Change the role?",
  verb: "Change role",
  doing: "Changing…",
  change: "Change role…",
  torque: "Torque goes off first on servos under command. The adapter is opened again.",
  guest: (reason: string) => `Guest${reason === "" ? "" : `: ${reason.replace(/\.$/, "").toLowerCase()}`}.`,
  guestCommanded: (nodes: string, n: number, all: number) =>
    `Guest: ${nodes.toLowerCase()} ${nodes.includes(",") ? "command" : "commands"} ${n} of ${servos(all)}.`,
  guestLine:
    "hornbill allocates no node IDs, reads at most 200\u202fframes/s, and moves only servos that no other node commands.",
  reaches: (names: string) => (names === "" ? "Stop reaches no servo now." : `Stop reaches ${names}.`),
  notAll: "Why not all?",
  reachWhy:
    "Torque off on a servo that the autopilot commands takes a control surface from it: in flight, the aircraft crashes. Stop therefore reaches only what hornbill commands. To stop the others too, press Stop, then Stop all servos in its band.",
  toAutopilot: "Autopilot…",
  observer: "Observer: hornbill sends nothing.",
  observerLine: "Servos are listed once they identify themselves to another node.",
  observerStop: "Stop sends nothing. To stop a servo, cut its supply, or change the role.",
  node: (id: number) => `Node ${id}`,
  everyone: (n: number) => (n === 1 ? "Stop the other servo…" : `Stop all ${n} servos…`),
  everyoneTitle: "Stop servos that the autopilot commands?",
  everyoneVerb: "Stop all servos",
  everyoneText:
    "Torque goes off on every servo of this bus. An aircraft in flight then loses its control surfaces and crashes. The autopilot continues to send commands but cannot move the servos until torque is turned on again.",
  by: "Commanded by",
  command: "Command",
  error: "Tracking error",
  you: "hornbill",
  none: "Not commanded",
  noCommand: "none",
  typed: (type: string) => `, ${type}`,
  since: (at: string) => `since ${at}`,
  holds: "Holds the last command",
  noRate: "single command",
  timeout: {
    off: (s: string) => `0x27: output off after ${s}`,
    hold: () => "0x26: holds the last command",
    brake: (s: string) => `0x27: brake after ${s}`,
  },
  type: {
    unitless: "ArrayCommand",
    position: "ArrayCommand, position",
    force: "ArrayCommand, force",
    speed: "ArrayCommand, speed",
    pwm: "ArrayCommand, PWM",
    unknown: "ArrayCommand, unknown type",
  },
};
