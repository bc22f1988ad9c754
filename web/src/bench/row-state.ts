/** State of a parameter row, its text, and possible actions. */
import type { Row } from "../api/types";
import { text } from "../text";
import type { Draft } from "./draft";
import { age, full, minute } from "./format";
import type { AllowedSpan } from "./number";
import type { KnownReading, Outcome } from "./parameters";

export type RowState =
  | "idle"
  | "staged"
  | "pending"
  | "applied"
  | "saved"
  | "failed"
  | "out_of_range"
  | "invalid"
  | "clamped"
  | "no_effect"
  | "stale";

export interface RowFacts {
  row: Row;
  reading: KnownReading | undefined;
  draft: Draft | undefined;
  outcome: Outcome | undefined;
  /** RAM differs from the known ROM value. */
  unsaved: boolean;
  /** The servo is online and the link is up. */
  reachable: boolean;
  /** Monotonic time; read only where an age is shown. */
  now: () => number;
}

export interface RowView {
  state: RowState;
  /** Shown after address and section; empty if none. */
  words: string;
  /** A register that would give this row an effect. */
  goTo: string | null;
}

/** Unit and range of a row on this servo. */
export function spanOf(
  row: Row,
  reading: KnownReading | undefined,
): AllowedSpan & { kind: Row["kind"]; choices: Row["choices"] } {
  const unit = reading?.unit ?? row.unit;
  const other = row.unit_when && row.unit_when.unit === unit && unit !== row.unit ? row.unit_when : null;
  return {
    unit,
    perUnit: other ? other.per_unit : row.per_unit,
    minimum: reading?.minimum ?? null,
    maximum: reading?.maximum ?? null,
    kind: row.kind,
    choices: row.choices,
  };
}

export function viewOf(facts: RowFacts): RowView {
  const { row, reading, draft, outcome, unsaved } = facts;
  const say = (state: RowState, words = "", goTo: string | null = null): RowView => ({ state, words, goTo });
  const sentence = text.rows.state;
  const span = spanOf(row, reading);

  if (draft && !draft.verdict.ok) {
    const ranged = draft.verdict.code === "above" || draft.verdict.code === "below";
    return say(ranged ? "out_of_range" : "invalid");
  }
  if (outcome?.kind === "pending") return say("pending", sentence.pending);
  if (outcome?.kind === "failed") return say("failed");
  if (draft?.verdict.ok && draft.verdict.value !== reading?.value) return say("staged", sentence.staged);
  if (outcome?.kind === "clamped") {
    return say("clamped", sentence.clamped(full(outcome.requested, span), full(reading?.value, span)));
  }
  if (outcome?.kind === "saved") return say("saved", sentence.saved(minute(outcome.at)));
  if (unsaved) return say("applied", sentence.applied);
  if (!reading || reading.raw === null) return say("stale", sentence.unread);
  if (reading.stale || !facts.reachable) {
    const words =
      reading.readAt === null
        ? sentence.lastReadUnknown
        : sentence.lastRead(age(Math.max(0, facts.now() - reading.readAt)));
    return say("stale", words);
  }
  if (reading.in_effect === false)
    return say("no_effect", whySaid(reading), target(reading.why_not, row.name));
  return say("idle");
}

/** "No effect now: …." in the page's language, or the server's. */
function whySaid({ why, why_not }: KnownReading): string {
  const sentence = why ? text.table.why[why.code] : undefined;
  if (sentence === undefined) return shorten(why_not ?? "");
  return text.rows.state.noEffect(
    sentence.replace("{last_command}", text.table.commands[why?.params?.last_command ?? ""] ?? ""),
  );
}

/** Two lines are for names: "speed and torque control (0x25)" becomes "0x25", the target of the link beside it. */
function shorten(sentence: string): string {
  return sentence.replace(/[^:.,()]+ \((0x[0-9A-F]{2})\)/g, " $1");
}

/** The register named in a "no effect" sentence, as target of a link; not the row itself. */
function target(sentence: string | null, own: string): string | null {
  for (const found of sentence?.matchAll(/0x[0-9A-F]{2}/g) ?? []) if (found[0] !== own) return found[0];
  return null;
}
