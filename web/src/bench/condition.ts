/** The condition of a servo: a kind (shape and colour), a headline and a line with the remedy. */
import type { FaultRow, Stop } from "../api/types";
import { text } from "../text";
import { activityLine, alarming } from "./activity";
import type { KnownServo } from "./fleet";
import { age, clock, number, withUnit } from "./format";
import { readOnly } from "./model";

export type ConditionKind =
  | "ok"
  | "notice"
  | "warning"
  | "protected"
  | "failure"
  | "busy"
  | "identifying"
  | "offline";

export interface Condition {
  kind: ConditionKind;
  headline: string;
  line: string;
  /** `line` itself is an alarm. */
  alarming?: boolean;
  /** What it does, if it matters and `line` says something else: output off and why, hunting, a timeout. */
  doing?: string;
  /** Saved values lost: a snapshot has them. */
  romLost?: boolean;
}

export interface ConditionFacts {
  faults: readonly FaultRow[];
  temperature: number | null;
  /** Seconds, monotonic. */
  now: number;
  /** A bus is connected. */
  connected: boolean;
  stop: Stop | null;
}

/** Name of the bit of 0x1A that reports it. */
export const ROM_LOST = "rom_lost";

const LEVELS = [
  ["failure", "failure"],
  ["warning", "warning"],
  ["notification", "notice"],
] as const;

export function conditionOf(servo: KnownServo, facts: ConditionFacts): Condition {
  const found = judge(servo, facts);
  const doing = unsaid(servo, found);
  if (doing !== null) found.doing = doing;
  if (servo.online && bits(servo, "warning", facts.faults).some(bit => bit.key === ROM_LOST))
    found.romLost = true;
  const confirmation = facts.stop?.latched ? facts.stop.servos.find(one => one.uid === servo.uid) : undefined;
  if (!confirmation) return found;
  if (!confirmation.confirmed) return { ...found, line: text.stop.noResponse, alarming: true };
  if (confirmation.ms === null) return found;
  return { ...found, line: text.stop.confirmed(withUnit(number(confirmation.ms, 0), "ms")) };
}

/** Activities that are unexpected of a healthy servo with its output on. */
const UNEXPECTED = new Set(["off", "brake", "released", "held_after_timeout", "hunting", "saturated"]);

/** What it does, if unusual and not already in `found`. */
function unsaid(servo: KnownServo, found: Condition): string | null {
  const { activity, output } = servo;
  if (!UNEXPECTED.has(activity.state) && output.state !== "off" && output.state !== "brake") return null;
  if (found.kind === "offline" || (found.kind === "protected" && output.reason === "protection")) return null;
  const line = activityLine(servo);
  return found.line === line || found.headline.endsWith(lower(line)) ? null : line;
}

function judge(servo: KnownServo, facts: ConditionFacts): Condition {
  const strings = text.state;
  // Silence during a save or restart is expected: its job reports it, and ends it.
  if (!servo.online && servo.state !== "saving" && servo.state !== "restarting") return offline(servo, facts);
  const failure = bits(servo, "failure", facts.faults);
  if (failure.length > 0) return fromBits("failure", failure);
  switch (servo.state) {
    case "identifying":
      return { kind: "identifying", headline: strings.identifying, line: strings.identifyingLine };
    case "saving":
      return { kind: "busy", headline: strings.saving, line: strings.savingLine };
    case "restarting":
      return { kind: "busy", headline: strings.restarting, line: strings.restartingLine };
    case "soft_start":
      return { kind: "busy", headline: strings.softStart, line: strings.softStartLine };
    case "updating":
      return { kind: "busy", headline: strings.updating, line: strings.updatingLine };
    case "protected":
      return guarded(servo, facts);
  }
  for (const [level, kind] of LEVELS.slice(1)) {
    const found = bits(servo, level, facts.faults);
    if (found.length > 0) return fromBits(kind, found);
    if (kind === "warning" && alarming(servo.activity)) return restless(servo);
  }
  if (servo.health === "error" || servo.health === "critical") {
    return { kind: "failure", headline: strings.failure(strings.health[servo.health]), line: "" };
  }
  if (servo.health === "warning") {
    return { kind: "warning", headline: strings.warning(strings.health.warning), line: "" };
  }
  return {
    kind: "ok",
    headline: strings.ok,
    line: readOnly(servo) ? text.servos.unknownLine : activityLine(servo),
  };
}

/** Hunting or saturated at rest: no bit of the servo reports it. */
function restless(servo: KnownServo): Condition {
  const strings = text.activity;
  const line = servo.activity.state === "hunting" ? strings.huntingAdvice : strings.saturatedAdvice;
  return { kind: "warning", headline: text.state.warning(lower(activityLine(servo))), line };
}

function offline(servo: KnownServo, facts: ConditionFacts): Condition {
  const silent = servo.angleAt === null ? null : Math.max(0, facts.now - servo.angleAt);
  const remedy = facts.connected ? text.state.checkSupply : text.state.connectBus;
  const seen =
    silent === null ? text.state.neverSeen : text.state.lastSeen(clock(Date.now() / 1000 - silent));
  return {
    kind: "offline",
    headline: silent === null ? text.state.offlineUnknown : text.state.offline(age(Math.floor(silent), 0)),
    line: `${seen}. ${remedy}`,
  };
}

function guarded(servo: KnownServo, facts: ConditionFacts): Condition {
  const found = bits(servo, "warning", facts.faults);
  const hot = found.some(bit => bit.key.includes("temperature")) && facts.temperature !== null;
  const what = hot
    ? text.state.protectedAt(withUnit(number(facts.temperature ?? 0, 0), "°C"))
    : (found[0] && lower(found[0].label)) || text.state.outputOff;
  return { kind: "protected", headline: text.state.protected(what), line: text.state.protectedLine };
}

interface Bit {
  key: string;
  label: string;
  advice: string;
}

function bits(servo: KnownServo, level: FaultRow["level"], table: readonly FaultRow[]): Bit[] {
  const word = (servo.faults[level] ?? 0) >>> 0;
  const found: Bit[] = [];
  for (let bit = 0; bit < 32; bit++) {
    if (((word >>> bit) & 1) === 0) continue;
    const row = table.find(one => one.level === level && one.bit === bit);
    found.push(row ?? { key: `bit_${bit}`, label: text.state.unknownBit(bit), advice: "" });
  }
  return found;
}

function fromBits(kind: "failure" | "warning" | "notice", found: Bit[]): Condition {
  const first = found[0];
  const what = lower(first?.label ?? "") + (found.length > 1 ? ` ${text.state.more(found.length - 1)}` : "");
  return { kind, headline: text.state[kind](what), line: first?.advice ?? "" };
}

// Labels are capitalised; inside a sentence only abbreviations stay so.
function lower(label: string): string {
  return /^[A-Z][a-z]/.test(label) ? label.charAt(0).toLowerCase() + label.slice(1) : label;
}

const NEEDS_A_LOOK = new Set<ConditionKind>(["notice", "warning", "protected", "failure", "offline"]);

export function needsAttention(kind: ConditionKind): boolean {
  return NEEDS_A_LOOK.has(kind);
}
