/** English words of export to an autopilot, live verification and failsafe. */
const list = (outputs: readonly number[]) =>
  outputs.length === 1
    ? `Output ${outputs[0]}: `
    : outputs.length === 0
      ? ""
      : `Outputs ${outputs.join(", ")}: `;

export const words = {
  title: "Autopilot",
  program: "Program",
  programs: { ardupilot: "ArduPilot", px4: "PX4" },
  rate: "Rate",
  outputs: "Outputs",
  against: (source: string, bus: string) => `${source} against ${bus}`,
  thisPlan: "This plan",
  line: "Which output drives which servo, and how far. Ends and neutral are angles of the servo.",
  head: {
    output: "Output",
    servo: "Servo",
    low: "CCW end",
    neutral: "Neutral",
    high: "CW end",
    reversed: "Reversed",
    function: "Function",
    remove: "Remove",
  },
  functionHint: "keep",
  id: (id: number) => `Servo ID ${id}`,
  noServo: "No servo with this ID",
  field: (what: string, output: number) => `${what}, output ${output}`,
  remove: (output: number) => `Remove output ${output}`,
  propose: "Propose again",
  import: "Import…",
  export: "Export",
  verify: "Verify live",
  incomplete: (outputs: readonly number[]) =>
    `${list(outputs)}enter ends, neutral and function as numbers to continue.`,
  noOutputs: "No servo has an ID that this autopilot can command.",
  noOutputsLine: (first: number, last: number) =>
    `Set the servo ID (0x45) of each servo to ${first} … ${last} on the Commission page, or import a file.`,
  loading: "Reading servos…",
  exported: (name: string) =>
    `${name} is downloaded. Load it into the autopilot, restart it, then verify live.`,
  imported: (name: string, n: number) => `${name}: ${n} ${n === 1 ? "output" : "outputs"} imported.`,
  advice: "Check before the first flight",
  advices: {
    servo_id_zero: (o: readonly number[]) =>
      `${list(o)}servo ID 0 is that of every new servo, so all of them obey it. Connect no other new servo.`,
    status_not_received: (o: readonly number[]) =>
      `${list(o)}PX4 receives Status for servo IDs 0 to 8 only and does not log this servo.`,
    throw_beyond_limits: (o: readonly number[]) =>
      `${list(o)}the ends are beyond the angle limits of the servo (0x38, 0x39), where it stops. Reduce the throw.`,
    step_above_deadband: (o: readonly number[]) =>
      `${list(o)}one step of the autopilot is 0.36°, more than the deadband of the servo.`,
    silent_when_unarmed: (o: readonly number[]) =>
      `${list(o)}with the safety switch on, ArduPilot sends no commands: the output goes off or brakes (0x26, 0x27).`,
    node_id_dynamic_range: (o: readonly number[]) =>
      `${list(o)}the node ID is static, within the range that the autopilot allocates. Set 0x46 to 0.`,
    position_in_log: (_o: readonly number[]) =>
      "In the logs of the autopilot, position × 100 is the angle in degrees: a servo reports 100° as 1.0.",
  },
  verifyHead: {
    output: "Output",
    servo: "Servo",
    exported: "Exported",
    bus: "On the bus",
    seen: (low: string, high: string) => `Seen, ${low} to ${high}`,
    result: "Result",
    cause: "Cause",
    measure: "Measure",
  },
  counts: (match: number, failed: number, warned: number, left: number) =>
    [
      `${match} ${match === 1 ? "matches" : "match"}`,
      failed > 0 ? `${failed} failed` : "",
      warned > 0 ? `${warned} ${warned === 1 ? "warning" : "warnings"}` : "",
      left > 0 ? `${left} not measured` : "",
    ]
      .filter(Boolean)
      .join(", "),
  step: (n: number, of: number) => `Step ${n} of ${of}:`,
  again: "Again:",
  neutral: "centre all controls",
  positive: (output: number, label: string) =>
    label === ""
      ? `hold the control of output ${output} fully positive`
      : `hold the control of ${label} fully positive`,
  left: (passed: string, all: string) => `${passed} of ${all}`,
  measure: "Measure",
  measureOne: (output: number) => `Measure output ${output}`,
  done: "All outputs are measured.",
  silent: "No ArrayCommand on the bus. Arm the autopilot and release its safety switch.",
  cancel: "Cancel",
  close: "Close",
  noEntry: "no entry",
  result: {
    matches: "Matches",
    reversed: "reversed",
    swapped: (other: number) => `swapped with ${other}`,
    missing: "missing",
    throw_too_small: "throw too small",
    throw_too_large: "throw too large",
    wrong_type: "wrong command type",
    not_moved: "Not moved enough yet",
  },
  of: (output: number, what: string) => `Output ${output}: ${what}`,
  within: (deg: string) => `Within ${deg} of the exported end.`,
  neutralWithin: "Neutral as exported. Hold its control fully positive.",
  acts: (name: string, seen: number, exported: number) => `${name} acts as ${seen}; exported as ${exported}.`,
  set: (name: string, value: number) => `Set ${name} to ${value}, as exported.`,
  assign: (name: string) => `Set ${name}: the output has no function.`,
  swapped: (output: number, other: number) =>
    `The control of output ${output} moved output ${other}. Exchange the functions of both outputs, or their servo IDs (0x45).`,
  wrongType: {
    ardupilot: "Not sent as UNITLESS. Clear bit 4 (PWM) of CAN_D1_UC_OPTION.",
    px4: "Not sent as UNITLESS.",
  },
  notMoved: "Hold its control fully positive while it is measured.",
  unknown: "Not known yet",
  unknownLine: "0x26 and 0x27 have not been read.",
  action: {
    hold: "Holds its last command",
    off: (s: string) => `Output off after ${s}`,
    brake: (s: string) => `Brakes after ${s}`,
  },
  actionLine: {
    hold: "If commands stop, the horn stays under torque indefinitely.",
    off: "If commands stop, the horn can then be moved freely.",
    brake: "If commands stop, the horn then resists weakly.",
  },
  noGap: "Not confirmed: no gap of commands longer than 0x27 was seen.",
  gap: (node: number, s: string, at: string) => `Node ${node} was silent for ${s} at ${at}.`,
  gapNow: (node: number, at: string) => `Node ${node} has been silent since ${at}.`,
  torque: (pct: string) => `Torque was then ${pct}.`,
  confirmed: "Confirmed by a measured gap",
};
