/** English words of the dialogs before a restart and a factory reset, and of their progress; loaded with them. */

const values = (n: number) => `${n} ${n === 1 ? "value" : "values"}`;
const servos = (n: number) => `${n} ${n === 1 ? "servo" : "servos"}`;

export const words = {
  /** Before the restart: what it holds meanwhile. */
  gap: {
    save: "The servo writes to ROM and restarts. It holds no torque for about a second, so a load can drop.",
    restart: "The servo holds no torque for about a second, so a load can drop.",
    "factory-reset": "Torque goes off first and stays off for a few seconds, so a load can drop.",
  },
  /** What the horn does at the start, by the forecast's code; and then. */
  horn: {
    moves: (from: string) => `The horn moves: ${from} to 0.0°`,
    unknown_start: "The horn moves to 0.0°",
    stays: "The horn stays at 0.0°",
    holds: "The horn stays where it is",
    no_torque: "The servo restarts with torque off",
    brake: "The servo restarts on the brake",
    unknown: "The horn may move to 0.0°",
  },
  after: {
    moves: "Then it turns slowly to 0.0°, at most 30\u202frpm and 30\u202f% torque.",
    unknown_start:
      "Then it turns slowly to 0.0°, from an angle that is not known: origin or direction change with the restart.",
    stays: "Then it holds within 1° of 0.0°.",
    holds: "Soft start is off: then it holds where it stands.",
    no_torque: "It holds nothing after the restart until torque is turned on.",
    brake: "After the restart it brakes weakly and holds no angle.",
    unknown: "What the horn does then is not known, because ROM was not read completely.",
  },
  /** By the warning's code; those not here are said by the sentences above, or concern a save only. */
  warnings: {
    turn_count_lost: (before: string, after: string) =>
      `The turn count is lost: ${before} will read as ${after}. The next move may go the other way.`,
    rom_lost: () =>
      "Its saved values could not be loaded at the last start, and may not load now: then it runs on defaults again. Restore a snapshot and save.",
    timeout_on_the_way: (after: string) =>
      `Its own timeout (0x26, 0x27) may switch the output off ${after} after the start: the horn then coasts to rest.`,
    energised: () =>
      "The output comes on for a moment before ROM is written, and holds the horn where it stands. Keep clear.",
    outside_limits: (here: string, limit: string) =>
      `The horn stands at ${here}, outside its angle limits: it may be moved to ${limit}.`,
    supply_near_limit: (supply: string, limit: string) =>
      `The supply is ${supply}, close to the limit of ${limit}. It must not sag while ROM is written.`,
    supply_unknown: () => "The supply was not read. It must be steady while ROM is written.",
    supply_beyond_limit: (supply: string) =>
      `The supply is ${supply}, beyond a limit that applies after the restart. The output stays off then.`,
  },
  facts: (model: string, serial: string, id: string) => `${model}, ${serial}, servo ${id}`,
  refused: (why: string) => `This is not possible now. ${why}`,
  planning: "Checking",

  restart: {
    title: (name: string) => `Restart ${name}?`,
    titleAll: (n: number) => `Restart ${servos(n)}?`,
    inTurn: "One servo at a time, in this order. Keep this page open until the last one has restarted.",
    lost: (n: number) => `${values(n)} in RAM only ${n === 1 ? "is" : "are"} lost`,
    lostHint: "Cancel and save to ROM first to keep them.",
    nothingLost: "No value is lost: RAM holds what ROM is known to hold.",
    head: { parameter: "Parameter", ram: "In RAM now", rom: "After, from ROM" },
    table: { servo: "Servo", horn: "Horn", lost: "Lost with RAM" },
    none: "none",
    leftOut: "Left out",
    go: (name: string) => `Restart ${name}`,
    goAll: (n: number) => `Restart ${servos(n)}`,
  },

  reset: {
    title: (name: string) => `Reset ${name} to factory defaults?`,
    keep: (id: string, node: string, origin: string) => `Keep servo ID ${id}, ${node} and origin ${origin}`,
    node: (id: string) => `node ID ${id}`,
    dynamicNode: "dynamic node ID",
    identityGoes:
      "The servo gets servo ID 0 and a dynamic node ID, and its zero may be another. It is found again by its unique ID.",
    changes: (n: number) => `${values(n)} ${n === 1 ? "changes" : "change"} in RAM and ROM`,
    nothing: "Every value is at its default already. The servo is written and restarted anyway.",
    head: { parameter: "Parameter", now: "Now", next: "Default" },
    snapshot: "A snapshot of the present values is taken first.",
    type: (name: string) => `Type ${name} to confirm`,
    go: (name: string) => `Reset ${name}`,
  },

  run: {
    title: {
      restart: { one: (name: string) => `Restarting ${name}`, all: (n: number) => `Restarting ${servos(n)}` },
      "factory-reset": {
        one: (name: string) => `Resetting ${name}`,
        all: (n: number) => `Resetting ${servos(n)}`,
      },
    },
    done: {
      restart: { one: (name: string) => `${name} restarted`, all: (n: number) => `${servos(n)} restarted` },
      "factory-reset": {
        one: (name: string) => `${name} is at factory defaults`,
        all: (n: number) => `${servos(n)} are at factory defaults`,
      },
    },
    failed: {
      restart: {
        one: (name: string) => `Restart of ${name} not confirmed`,
        all: (n: number) => `${servos(n)} not restarted`,
      },
      "factory-reset": {
        one: (name: string) => `${name} was not reset`,
        all: (n: number) => `${servos(n)} not reset`,
      },
    },
    keepOn: "Keep the supply on until this is done.",
    of: (done: number, all: number) => `${done} of ${all} done`,
    state: {
      waiting: "Waiting",
      running: "Running",
      done: "Done",
      failed: "Failed",
      left_out: "Not started",
    },
    steps: (name: string) => `Steps of ${name}`,
  },
};
