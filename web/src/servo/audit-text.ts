/** Texts of stored codes: reasons of snapshots and entries of the audit. */
import type { AuditRow, ReasonCode } from "../api/config-types";
import type { Params } from "../api/types";
import { type FactsText, factsOf } from "../bench/facts";
import { noteText } from "../bench/note-text";
import { audit as words } from "./words";

const reasons: Readonly<Partial<Record<ReasonCode, FactsText>>> = words.reasons;

/** Reason of a snapshot; the user's text where it has no code. */
export function reasonText(reason: string, code: ReasonCode | null, params: Params): string {
  return (code && reasons[code]?.(factsOf(params))) ?? reason;
}

/** Notes of an audit entry besides its values. */
export function auditedNotes(row: AuditRow): string[] {
  return row.notes.map(({ code, params, text }) => {
    if (code !== "reason") return noteText(text, code, params);
    const { reason, ...values } = params ?? {};
    return reasonText(text, reason as ReasonCode, values);
  });
}

/** The word for an action or outcome of the audit. */
export function auditWord(word: string): string {
  return words.words[word] ?? word.replaceAll("_", " ");
}
