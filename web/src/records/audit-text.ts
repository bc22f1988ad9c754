/** How what hornbill keeps by code is said to people: why a snapshot was taken, what the audit tells. */
import type { AuditRow, ReasonCode } from "../api/config-types";
import type { Params } from "../api/types";
import { factsOf, type Saying } from "../bench/facts";
import { records as words } from "../text/topics";

const said: Readonly<Partial<Record<ReasonCode, Saying>>> = words.reasons;

/** Why a snapshot was taken; in the words of the user where it has no code. */
export function reasonText(reason: string, code: ReasonCode | null, params: Params): string {
  return (code && said[code]?.(factsOf(params))) ?? reason;
}

/** The same as a row of the audit has it. */
export function auditedReason(row: AuditRow): string {
  const { reason, ...params } = (row.requested ?? {}) as Params & { reason?: ReasonCode };
  return reasonText(row.detail, reason ?? null, params);
}

/** A word of the audit, for an action or for what came of it. */
export function auditWord(word: string): string {
  return words.audit.words[word] ?? word.replaceAll("_", " ");
}
