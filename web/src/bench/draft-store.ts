/** Stores staged edits over a reload, for the tab. */
import { effect } from "@preact/signals";
import type { Draft, DraftMap, Drafts } from "./draft";
import { peekServo } from "./fleet";
import { readTab, writeTab } from "./tab-store";

const NAME = "hornbill.drafts";

/** As stored, by servo and row. Invalid text has no value: it is checked again. */
type Stored = Record<string, Record<string, { text: string; value?: boolean | number | string }>>;

const kept: Stored = known(readTab(NAME));

function known(found: unknown): Stored {
  const whole = (one: unknown) => typeof one === "object" && one !== null;
  return whole(found) && Object.values(found as object).every(whole) ? (found as Stored) : {};
}

/** Restore the edits staged before the reload, and store edits from now on. */
export function keepDrafts(uid: string, drafts: Drafts): void {
  drafts.restore(
    new Map(
      Object.entries(kept[uid] ?? {})
        .filter(([, one]) => typeof one?.text === "string")
        .map(([key, one]) => [key, draftOf(one)]),
    ),
  );
  effect(() => {
    const next = stored(drafts.map.value);
    if (Object.keys(next).length > 0) kept[uid] = next;
    else delete kept[uid];
    writeTab(NAME, kept);
  });
}

function draftOf({ text, value }: Stored[string][string]): Draft {
  if (value !== undefined) return { text, verdict: { ok: true, value } };
  return { text, verdict: { ok: false, code: "empty", what: "", remedy: "", nearest: null } };
}

function stored(drafts: DraftMap): Stored[string] {
  return Object.fromEntries(
    [...drafts].map(([key, { text, verdict }]) => [
      key,
      verdict.ok ? { text, value: verdict.value } : { text },
    ]),
  );
}

/** True if a known servo has unsent edits. */
export function hasDrafts(): boolean {
  return Object.keys(kept).some(uid => peekServo(uid) !== undefined);
}
