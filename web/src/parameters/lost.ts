/** RAM values lost in a restart, as the server reports them: staged again, or dismissed. */
import { callApi } from "../api/client";
import type { Servo } from "../api/types";
import { catalog } from "../bench/catalog";
import type { Sheet } from "../bench/parameters";
import { draftFor, stageValue } from "../change/stage";

export type Lost = NonNullable<Servo["lost"]>;

/** Values not yet staged that can be. */
export function stageable(sheet: Sheet, lost: Lost): Lost {
  return lost.filter(one => {
    const draft = sheet.drafts.get(one.key);
    return draftOf(sheet, one) !== null && !(draft?.verdict.ok && draft.verdict.value === one.value);
  });
}

export function stageAgain(sheet: Sheet, lost: Lost): void {
  for (const one of lost) {
    const draft = draftOf(sheet, one);
    if (draft) stageValue(sheet, one.key, draft);
  }
}

/** Dismiss them on the server; nothing is sent to the servo. */
export function dismiss(uid: string): Promise<void> {
  return callApi("DELETE", "/servos/{uid}/lost", { path: { uid } });
}

function draftOf(sheet: Sheet, one: Lost[number]) {
  const row = catalog.value?.rows.get(one.key);
  if (!row || one.value === null) return null;
  const draft = draftFor(sheet, row, one.value);
  return "why" in draft ? null : draft;
}
