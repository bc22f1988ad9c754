/** Writing to many servos in one request: what would become of it, and what each servo's rows are told. */
import { ask, type Problem, problemOf } from "../api/client";
import type { BatchOutcome, BatchPatched, SafetyWord, SavePreview } from "../api/config-types";
import type { Change, Job, ProblemBody } from "../api/types";
import { staged } from "../bench/draft";
import { failureText } from "../bench/facts";
import { settled } from "../bench/jobs";
import { asProblem, sheetOf } from "../bench/parameters";
import { refuse, takeOutcomes, type WantedValue } from "./apply";

function asBody({ code, status, message, facts }: Problem): ProblemBody {
  return { ...facts, type: "", title: "", code, status, detail: message } as ProblemBody;
}

/** What is staged and may be sent, by servo; servos with nothing are left out. */
export function stagedOn(uids: readonly string[]): Map<string, Map<string, WantedValue>> {
  const found = new Map<string, Map<string, WantedValue>>();
  for (const uid of uids) {
    const sheet = sheetOf(uid);
    const values = staged(sheet.drafts.map.value, key => sheet.held(key));
    if (values.size > 0) found.set(uid, values);
  }
  return found;
}

export interface BatchWish {
  dry_run: boolean;
  save: boolean;
  confirm: readonly SafetyWord[];
}

/** Asks what would become of it, or does it. Each servo is changed all or nothing. */
export async function writeMatrix(
  values: ReadonlyMap<string, ReadonlyMap<string, WantedValue>>,
  wish: BatchWish,
): Promise<BatchOutcome[]> {
  const uids = [...values.keys()];
  const answer = await ask<BatchPatched>("PATCH", "/parameters", {
    body: {
      servos: Object.fromEntries([...values].map(([uid, one]) => [uid, Object.fromEntries(one)])),
      revisions: Object.fromEntries(uids.map(uid => [uid, sheetOf(uid).revision])),
      ...wish,
    },
    timeout_ms: 90_000,
  });
  if (!wish.dry_run) for (const one of answer.servos) tell(one, values);
  return answer.servos;
}

/** What a save of RAM would do on each of these servos; one that is refused says why. Nothing is written. */
export function planSaves(uids: readonly string[], confirm: readonly SafetyWord[]): Promise<BatchOutcome[]> {
  return Promise.all(
    uids.map(async (uid): Promise<BatchOutcome> => {
      const none = { uid, changes: [], revision: null };
      try {
        const body = { confirm, dry_run: true };
        const plan = await ask<SavePreview>("POST", `/servos/${uid}/save`, { body, timeout_ms: 30_000 });
        return { ...none, ...plan, outcome: "planned" };
      } catch (error) {
        return { ...none, outcome: "rejected", problem: asBody(problemOf(error)) };
      }
    }),
  );
}

/** Tells a servo's rows what became of them. */
function tell(one: BatchOutcome, values: ReadonlyMap<string, ReadonlyMap<string, WantedValue>>): void {
  const sheet = sheetOf(one.uid);
  if (one.revision) sheet.revision = one.revision;
  if (one.outcome === "applied" || one.outcome === "rolled_back") {
    takeOutcomes(sheet, {
      outcome: one.outcome,
      changes: one.changes,
      failure: one.problem ? failureText(one.problem) : null,
    });
  } else if (one.problem) {
    refuse(sheet, [...(values.get(one.uid)?.keys() ?? [])], asProblem(one.problem));
  }
}

export function changed(changes: readonly Change[]): Change[] {
  return changes.filter(one => one.verdict !== "unchanged");
}

/** Waits for a servo's save, and marks the rows it put into ROM. Answers the job as it ended. */
export async function endOfSave(uid: string, job: string, keys: readonly string[]): Promise<Job> {
  const end = await settled(job);
  const at = end.ended_at ?? Date.now() / 1000;
  if (end.state === "succeeded") sheetOf(uid).setOutcomes(keys.map(key => [key, { kind: "saved", at }]));
  return end;
}
