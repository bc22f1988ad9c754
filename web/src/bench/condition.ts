/** What is said of a servo's health: one kind (shape and colour), a headline and a line on what to do. */
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
  /** Set when `line` itself is bad news. */
  alarming?: boolean;
  /** What it does where that matters and `line` says something else: output off and why, hunting, a time-out. */
  doing?: string;
  /** Its saved values are lost: a snapshot has them. */
  romLost?: boolean;
}

export interface ConditionFacts {
  faults: readonly FaultRow[];
  temperature: number | null;
  /** Our monotonic clock. */
  now: number;
  /** Whether there is a bus to hear servos on. */
  connected: boolean;
  stop: Stop | null;
}

/** The bit of 0x1A that says so, by its name in the tables. */
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

/** Activities that nobody expects of a servo that is on and well. */
const TOLD = new Set(["off", "brake", "released", "held_after_timeout", "hunting", "saturated"]);

/** What it does, where that is out of the ordinary, unless what was found says it already. */
function unsaid(servo: KnownServo, found: Condition): string | null {
  const { activity, output } = servo;
  if (!TOLD.has(activity.state) && output.state !== "off" && output.state !== "brake") return null;
  if (found.kind === "offline" || (found.kind === "protected" && output.reason === "protection")) return null;
  const line = activityLine(servo);
  return found.line === line || found.headline.endsWith(lower(line)) ? null : line;
}

function judge(servo: KnownServo, facts: ConditionFacts): Condition {
  const said = text.state;
  // Silent while it saves or restarts is as it should be: its job says so, and ends it.
  if (!servo.online && servo.state !== "saving" && servo.state !== "restarting") return offline(servo, facts);
  const failure = bits(servo, "failure", facts.faults);
  if (failure.length > 0) return fromBits("failure", failure);
  switch (servo.state) {
    case "identifying":
      return { kind: "identifying", headline: said.identifying, line: said.identifyingLine };
    case "saving":
      return { kind: "busy", headline: said.saving, line: said.savingLine };
    case "restarting":
      return { kind: "busy", headline: said.restarting, line: said.restartingLine };
    case "soft_start":
      return { kind: "busy", headline: said.softStart, line: said.softStartLine };
    case "updating":
      return { kind: "busy", headline: said.updating, line: said.updatingLine };
    case "protected":
      return guarded(servo, facts);
  }
  for (const [level, kind] of LEVELS.slice(1)) {
    const found = bits(servo, level, facts.faults);
    if (found.length > 0) return fromBits(kind, found);
    if (kind === "warning" && alarming(servo.activity)) return restless(servo);
  }
  if (servo.health === "error" || servo.health === "critical") {
    return { kind: "failure", headline: said.failure(said.health[servo.health]), line: "" };
  }
  if (servo.health === "warning") {
    return { kind: "warning", headline: said.warning(said.health.warning), line: "" };
  }
  return {
    kind: "ok",
    headline: said.ok,
    line: readOnly(servo) ? text.servos.unknownLine : activityLine(servo),
  };
}

/** At rest, and it hunts or saturates: no bit of the servo says so. */
function restless(servo: KnownServo): Condition {
  const said = text.activity;
  const line = servo.activity.state === "hunting" ? said.huntingAdvice : said.saturatedAdvice;
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

// Labels begin with a capital; inside a sentence only abbreviations keep it.
function lower(label: string): string {
  return /^[A-Z][a-z]/.test(label) ? label.charAt(0).toLowerCase() + label.slice(1) : label;
}

const NEEDS_A_LOOK = new Set<ConditionKind>(["notice", "warning", "protected", "failure", "offline"]);

export function needsAttention(kind: ConditionKind): boolean {
  return NEEDS_A_LOOK.has(kind);
}
