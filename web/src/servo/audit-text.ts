/** How what hornbill keeps by code is said to people: why a snapshot was taken, what the audit tells. */
import type { AuditRow, ReasonCode } from "../api/config-types";
import type { Params } from "../api/types";
import { factsOf, type Saying } from "../bench/facts";
import { noteText } from "../bench/note-text";
import { audit as words } from "./words";

const said: Readonly<Partial<Record<ReasonCode, Saying>>> = words.reasons;

/** Why a snapshot was taken; in the words of the user where it has no code. */
export function reasonText(reason: string, code: ReasonCode | null, params: Params): string {
  return (code && said[code]?.(factsOf(params))) ?? reason;
}

/** What a row of the audit says beyond its values. */
export function auditedNotes(row: AuditRow): string[] {
  return row.notes.map(({ code, params, text }) => {
    if (code !== "reason") return noteText(text, code, params);
    const { reason, ...values } = params ?? {};
    return reasonText(text, reason as ReasonCode, values);
  });
}

/** A word of the audit, for an action or for what came of it. */
export function auditWord(word: string): string {
  return words.words[word] ?? word.replaceAll("_", " ");
}
