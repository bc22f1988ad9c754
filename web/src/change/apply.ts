/** Writes the rows of one servo: staged edits to RAM, saves, undo, and the outcome of each row. */

import { type Problem, problemOf } from "../api/client";
import type { SavePreview } from "../api/config-types";
import type { Change, ParametersPatched, Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { staged } from "../bench/draft";
import { problemText } from "../bench/facts";
import { type KnownServo, peekServo } from "../bench/fleet";
import { full } from "../bench/format";
import type { Outcome, Sheet, WantedValue, Written } from "../bench/parameters";
import { text } from "../text";
import { type ChangeRequest, doChange, type PlanOptions } from "./flow";
import { followSave, followWrite, plannedPart, preview, send, startJob } from "./send";
import { saving } from "./words";

/** Uptime is reported in whole seconds, and late. */
const SAME_BOOT_S = 3;

/** True if the servo has restarted since a write: RAM was then loaded from ROM. */
export function restartedSince(written: Written, one: KnownServo): boolean {
  if (one.state === "restarting") return true;
  if (!one.online || one.bootAt === null || written.bootAt === null) return false;
  return Math.abs(one.bootAt - written.bootAt) > SAME_BOOT_S;
}

/** Rows of a write that can be undone: those that still have the written value. */
export function undoable(written: Written, sheet: Sheet): readonly Change[] {
  return written.changes.filter(change => sheet.held(change.key) === change.after);
}

type Values = ReadonlyMap<string, WantedValue>;

export interface ApplyOptions {
  /** These rows only; other drafts stay. */
  only?: readonly string[];
  headers?: Record<string, string>;
}

/** Write the staged values to RAM, all or nothing. Returns whether all were written. */
export async function apply(sheet: Sheet, { only, headers = {} }: ApplyOptions = {}): Promise<boolean> {
  const values = new Map([...stagedIn(sheet)].filter(([key]) => only?.includes(key) ?? true));
  sheet.trouble.value = null;
  if (values.size === 0) return true;
  return doChange({
    kind: "apply",
    save: "never",
    together: true,
    quick: true,
    count: values.size,
    facts: sheet.uid,
    run: async (opts, _, report) => {
      const response = await write(sheet, values, opts, headers);
      await followWrite(sheet.uid, response, report, "");
      // The row shows what the servo did with it.
      if (response.changes.some(one => !WELL.has(one.verdict))) report("", { state: "failed" });
    },
  });
}

/** Write back the values before the last write. */
export function undoChange(sheet: Sheet, changes: readonly Change[]): ChangeRequest {
  const values: Values = new Map(
    changes.flatMap(one => (one.before === null ? [] : [[one.key, one.before] as const])),
  );
  return {
    kind: "undo",
    save: "never",
    quick: true,
    needsChanges: true,
    facts: sheet.uid,
    plan: async opts => [plannedPart(sheet.uid, await patch(sheet, values, opts, { dry_run: true }), false)],
    run: async (opts, _, report) => {
      // Edits staged over it would be applied with the next press, and undo the undo.
      sheet.drafts.drop(values.keys());
      const response = await write(sheet, values, opts);
      sheet.written.value = null;
      await followWrite(sheet.uid, response, report);
    },
  };
}

/** Save RAM to ROM, after writing the staged values to RAM. */
export function saveChange(sheet: Sheet, keys: readonly string[]): ChangeRequest {
  const { uid } = sheet;
  const options = ({ confirm }: PlanOptions, dry: { dry_run?: true } = {}) => ({
    path: { uid },
    body: { confirm, ...dry },
  });
  return {
    kind: "save",
    save: "always",
    count: keys.length,
    plan: async opts => {
      const values = stagedIn(sheet);
      sheet.trouble.value = null;
      const response: SavePreview =
        values.size === 0
          ? await preview("/servos/{uid}/save", options(opts, { dry_run: true }))
          : await patch(sheet, values, opts, { dry_run: true });
      return [{ ...plannedPart(uid, response, true), changes: [] }];
    },
    run: async (opts, _, report) => {
      const values = stagedIn(sheet);
      sheet.busy.value = "saving";
      try {
        const why =
          values.size === 0
            ? await followSave(uid, await startJob("/servos/{uid}/save", options(opts)), keys, report)
            : await followWrite(uid, await write(sheet, values, opts), report, uid, keys);
        if (why !== null) sheet.trouble.value = saving.notSaved(why);
      } finally {
        sheet.busy.value = null;
      }
    },
  };
}

const stagedIn = (sheet: Sheet): Values => staged(sheet.drafts.map.peek(), key => sheet.held(key));

function patch(
  sheet: Sheet,
  values: Values,
  { save, confirm }: PlanOptions,
  more: { dry_run?: true; headers?: Record<string, string> } = {},
): Promise<ParametersPatched> {
  const { headers, ...dry } = more;
  const body = {
    values: Object.fromEntries(values),
    ...(confirm.length > 0 ? { confirm } : {}),
    ...(save ? { save } : {}),
    ...dry,
  };
  return send("PATCH", "/servos/{uid}/parameters", {
    path: { uid: sheet.uid },
    body,
    headers: { "If-Match": sheet.revision, ...headers },
  });
}

/** Write values, all or nothing: each row gets its outcome, and undo data is stored. */
async function write(
  sheet: Sheet,
  values: Values,
  opts: PlanOptions,
  headers: Record<string, string> = {},
): Promise<ParametersPatched> {
  const keys = [...values.keys()];
  sheet.trouble.value = null;
  sheet.busy.value = "applying";
  sheet.setOutcomes(keys.map(key => [key, { kind: "pending" }]));
  try {
    const response = await patch(sheet, values, opts, { headers });
    sheet.takeWritten(response.revision, response.changes);
    const changes = response.changes.filter(one => one.verdict !== "unchanged" && one.before !== null);
    if (response.outcome === "applied" && !opts.save && changes.length > 0) {
      sheet.written.value = {
        at: Date.now() / 1000,
        bootAt: peekServo(sheet.uid)?.bootAt ?? null,
        changes,
      };
    }
    takeOutcomes(sheet, response);
    return response;
  } catch (error) {
    const problem = problemOf(error);
    refuse(sheet, keys, problem);
    if (problem.code !== "needs_confirmation") await sheet.load();
    throw problem;
  } finally {
    sheet.busy.value = null;
  }
}

/**
 * Take the response to a write of some rows: remove drafts that are done, set outcomes. Returns whether all succeeded.
 */
export function takeOutcomes(
  sheet: Sheet,
  response: Pick<ParametersPatched, "outcome" | "changes" | "failure">,
): boolean {
  const culprits = response.changes.filter(
    change => !WELL.has(change.verdict) && change.verdict !== "rolled_back",
  );
  const outcomes: [string, Outcome | null][] = [];
  const done: string[] = [];
  for (const change of response.changes) {
    if (WELL.has(change.verdict)) {
      outcomes.push([change.key, null]);
      done.push(change.key);
    } else if (change.verdict === "clamped" && response.outcome === "applied") {
      outcomes.push([change.key, { kind: "clamped", requested: change.requested }]);
      done.push(change.key);
    } else {
      outcomes.push([change.key, failure(change, culprits, response.failure ?? null)]);
    }
  }
  sheet.drafts.drop(done);
  sheet.setOutcomes(outcomes);
  return response.outcome === "applied" && culprits.length === 0;
}

const WELL = new Set<Change["verdict"]>(["applied", "unchanged", "planned"]);

function failure(change: Change, culprits: Change[], why: string | null): Outcome {
  const row = catalog.peek()?.rows.get(change.key);
  const show = (value: Value) => (row ? full(value, { ...row, perUnit: row.per_unit }) : String(value));
  const holds = text.rows.ramHolds(show(change.before));
  if (change.verdict === "rolled_back") {
    const others = culprits.map(one => catalog.peek()?.rows.get(one.key)?.label ?? one.key).join(", ");
    return { kind: "failed", what: text.rows.rolledBack(others), rest: holds };
  }
  const reason = why ?? text.rows.verdict[change.verdict] ?? change.verdict;
  return { kind: "failed", what: text.rows.notWritten(reason), rest: holds };
}

/** Mark rows as not written, with the reason: the row named by the problem, or all of them. */
export function refuse(sheet: Sheet, keys: string[], problem: Problem): void {
  const named = [problem.facts.key, problem.facts.parameter].find(
    fact => typeof fact === "string" && keys.includes(fact),
  );
  // It stays staged without an error: it needs a confirmation.
  if (problem.code === "needs_confirmation") {
    sheet.setOutcomes(keys.map(key => [key, null]));
    return;
  }
  if (problem.code === "stale_revision") {
    sheet.trouble.value = text.rows.staleRevision;
    sheet.setOutcomes(keys.map(key => [key, null]));
    return;
  }
  const what = text.rows.notWritten(problemText(problem));
  const hit = typeof named === "string" ? [named] : keys;
  sheet.setOutcomes(keys.map(key => [key, hit.includes(key) ? { kind: "failed", what, rest: "" } : null]));
}
