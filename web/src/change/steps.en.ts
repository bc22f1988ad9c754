/** English names of the steps of jobs. In English the server words their evidence. */
import type { EvidenceCode, Job, PlanStep, StepCode } from "../api/types";
import type { FactsText } from "../bench/facts";

const saving = {
  silence: "Silent while it writes and restarts",
  restart: "Restarted",
  back: "Back on the bus",
  soft_start: "Soft start finished",
};

const steps: Readonly<Record<Job["kind"], Partial<Record<StepCode, string>>>> = {
  save: {
    ...saving,
    check: "At rest; supply and RAM read",
    snapshot: "Snapshot taken",
    write: "Written to ROM",
    read_back: "Verified: every saved row read back from ROM",
  },
  restart: {
    ...saving,
    request: "Restart requested",
    silence: "Silent while it restarts",
    read_back: "Every row read",
  },
  factory_reset: {
    check: "Supply and RAM read",
    snapshot: "Snapshot taken",
    torque_off: "Torque off",
    erase: "Reset by the servo",
    read: "Current values read",
    identity: "Identity written back",
    rows: "Remaining differences written",
    save: "Saved to ROM",
    verify: "Every row verified",
  },
  identify: {
    check: "Horn at rest; torque and limits read",
    limit: "Speed and torque limited",
    wiggle: "Wiggled",
    return: "Back at its first angle",
    restore: "All values restored",
  },
  step_test: {
    check: "Ready; test conditions recorded",
    measure: "Steps measured",
    evaluate: "Results calculated and stored",
  },
  frequency_response: {
    check: "Ready; test conditions recorded",
    measure: "Response measured",
    evaluate: "Response calculated and stored",
  },
  mechanics: {
    check: "Checked; conditions recorded",
    deadband: "Deadband measured",
    repeatability: "Approached from both sides",
    speed: "Speed measured",
    friction: "Friction, inertia and load measured",
    travel: "Range swept",
    end_stops: "End stops searched",
    restore: "All values restored",
    evaluate: "Results stored",
  },
  improve: {
    check: "Checked; limits written",
    baseline: "Present gains measured",
    identify: "Horn and load identified",
    search: "Better gains found on the model",
    confirm: "Measured with the new gains",
    finish: "Gains kept or restored, and verified",
    improve: "Improved",
  },
  profile: {
    plan: "Values checked",
    write: "Written and read back",
    save: "Saved",
  },
  commissioning: {
    check: "Still as planned",
    park_servo_id: "Servo ID set to 0 to free it for its next servo",
    park_node_id: "Node ID set to dynamic and saved, to free it for its next servo",
    identify: "Horn wiggled",
    write: "Label, IDs and values written and read back",
    save: "Saved",
    verify: "Verified as planned",
  },
  restore_output: { clear: "Stop cleared", restore: "Output on" },
  plan: {
    write: "Profile written and read back",
    check: "Commands checked",
    torque_on: "Torque on",
    move: "Move",
    speed: "Turn at a speed",
    torque: "Push with a torque",
    wait: "Wait",
    torque_off: "Torque off",
  },
};

const evidence: Readonly<Partial<Record<EvidenceCode, FactsText>>> = {};

/** Steps of a test plan, with their values. */
const planned: Readonly<Record<PlanStep["do"], FactsText>> = {
  move: p => `Move to ${p.angle_deg}`,
  speed: p => `Turn at ${p.rpm} for ${p.for_s}`,
  torque: p => `Push with ${p.torque_pct} for ${p.for_s}`,
  wait: p => `Wait ${p.for_s}`,
};

export const words = {
  steps,
  planned,
  numbered: (n: number, step: string) => `${n}. ${step}`,
  evidence,
  /** A step on one of several servos. */
  of: (servo: string, step: string) => `${servo}: ${step}`,
};
