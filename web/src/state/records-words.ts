/** Owns how what hornbill keeps as words of its own is said to people: why a snapshot was taken, what the audit tells. */
import { labelOf } from "../form/row-text";
import { records as words } from "../text/topics";
import { catalog } from "./catalog";

const said = words.reasons;

const FIXED: Record<string, string> = {
  "by hand": said.byHand,
  "before saving": said.beforeSaving,
  "before factory reset": said.beforeReset,
  "before drift is undone": said.beforeDrift,
  commissioning: said.commissioning,
  matrix: said.matrix,
};

const BEFORE_CHANGE = /^before a change of (\w+)(?: and (\d+) more)?$/;
const PROFILE = /^profile (.+)$/;
const RESTORED = /^restore of snapshot (\d+)$/;

/** Why a snapshot was taken. What somebody typed, and what a newer server says, stays as it is. */
export function reasonText(reason: string): string {
  const fixed = FIXED[reason];
  if (fixed !== undefined) return fixed;
  const change = BEFORE_CHANGE.exec(reason);
  if (change?.[1] !== undefined && catalog.peek()?.rows.has(change[1])) {
    return said.beforeChange(labelOf(change[1]), Number(change[2] ?? 0));
  }
  const profile = PROFILE.exec(reason);
  if (profile?.[1] !== undefined) return said.profile(profile[1]);
  const restored = RESTORED.exec(reason);
  if (restored?.[1] !== undefined) return said.restored(restored[1]);
  return reason;
}

/** A word of the audit, for an action or for what came of it. */
export function auditWord(word: string): string {
  return words.audit.words[word] ?? word.replaceAll("_", " ");
}
