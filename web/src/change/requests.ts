/** Changes that are confirmed in the dialog, as data. */

import { type Signal, signal } from "@preact/signals";
import { callApi, type Problem, problemOf } from "../api/client";
import type { BatchOutcome, Profile, ResetPreview, SavePreview } from "../api/config-types";
import type { Change, Job, LeftOut, ProblemBody } from "../api/types";
import { staged } from "../bench/draft";
import { endText, failureText, problemText } from "../bench/facts";
import { peekServo } from "../bench/fleet";
import { settled } from "../bench/jobs";
import { leaseHeader } from "../bench/motion";
import { noteText } from "../bench/note-text";
import { asProblem, readSheet, sheetOf, type WantedValue } from "../bench/parameters";
import { refuse, takeOutcomes } from "./apply";
import { type ChangeRequest, openChange, type Part, type PlanOptions, type Report, type Turn } from "./flow";
import { changed, followSave, followWrite, plannedPart, preview, send, startJob } from "./send";

/** Plan each servo separately: a refused one carries the reason. */
function each(uids: readonly string[], look: (uid: string) => Promise<Part>): Promise<Part[]> {
  return Promise.all(
    uids.map(uid => look(uid).catch((error): Part => ({ uid, changes: [], problem: problemOf(error) }))),
  );
}

/** Refusals that apply to all other servos, too. */
const OF_ALL = new Set(["stopped", "lease_held", "bus_disconnected", "no_link", "unauthorized"]);

/** A job per servo, in sequence. A failure does not stop the others; none is started after a stop. */
async function inTurn(
  uids: readonly string[],
  start: (uid: string) => Promise<string>,
  report: Report,
): Promise<void> {
  let end: Problem | null = null;
  for (const uid of uids) {
    if (end !== null) {
      report(uid, { state: "left_out", why: problemText(end) });
      continue;
    }
    report(uid, { state: "running" });
    try {
      const job = await start(uid);
      report(uid, { job });
      const done = await settled(job);
      const well = done.state === "succeeded";
      report(uid, well ? { state: "done" } : { state: "failed", why: endText(done) });
      readSheet(uid);
    } catch (error) {
      const problem = problemOf(error);
      if (OF_ALL.has(problem.code)) end = problem;
      report(uid, { state: end ? "left_out" : "failed", why: problemText(problem) });
    }
  }
}

const rowsOf = (changes: readonly Change[]) =>
  changes.map(one => ({ key: one.key, now: one.before, next: one.requested }));

/** Restart in this order. */
export function restartChange(uids: readonly string[]): ChangeRequest {
  return {
    kind: "restart",
    save: "never",
    plan: () =>
      each(uids, async uid => {
        const { lost, restart } = await preview("/servos/{uid}/restart", {
          path: { uid },
          body: { dry_run: true },
          headers: leaseHeader(),
        });
        return { uid, changes: rowsOf(lost), restart };
      }),
    run: (_, able, report) =>
      inTurn(
        able.map(one => one.uid),
        uid => startJob("/servos/{uid}/restart", { path: { uid }, body: {}, headers: leaseHeader() }),
        report,
      ),
  };
}

export interface ResetFacts {
  keep: Signal<boolean>;
  /** The name to type. */
  name: string;
  typed: Signal<string>;
  /** Values that are kept, as first planned. */
  kept: Signal<ResetPreview["kept"] | null>;
}

export function resetChange(uid: string, name: string): ChangeRequest & { facts: ResetFacts } {
  const facts: ResetFacts = { keep: signal(true), name, typed: signal(""), kept: signal(null) };
  const options = (dry: { dry_run?: true } = {}) => ({
    path: { uid },
    body: { keep_identity: facts.keep.peek(), ...dry },
    headers: leaseHeader(),
  });
  return {
    kind: "factory-reset",
    save: "never",
    facts,
    ready: () => facts.typed.value.trim() === name,
    plan: async () => {
      const { changes, restart, kept } = await preview(
        "/servos/{uid}/factory-reset",
        options({ dry_run: true }),
      );
      facts.kept.value ??= kept;
      return [{ uid, changes: rowsOf(changes), restart }];
    },
    run: (_, __, report) => inTurn([uid], () => startJob("/servos/{uid}/factory-reset", options()), report),
  };
}

/** Restore rows of a snapshot; null for all. */
export function snapshotChange(
  uid: string,
  id: number,
  keys: readonly string[] | null,
  onClose: (turns: readonly Turn[]) => void,
): ChangeRequest {
  const sent = (opts: PlanOptions, dry_run: boolean) =>
    send("POST", "/servos/{uid}/snapshots/{snapshot_id}/restore", {
      path: { uid, snapshot_id: id },
      body: { ...opts, keys, dry_run },
      timeout_ms: 60_000,
    });
  return {
    kind: "snapshot",
    save: "optional",
    quick: true,
    needsChanges: true,
    onClose,
    plan: async opts => {
      const response = await sent(opts, true);
      return [{ ...plannedPart(uid, response, opts.save), leftOut: response.left_out.map(leftOutOf) }];
    },
    run: async (opts, _, report) => {
      await followWrite(uid, await sent(opts, false), report);
    },
  };
}

const leftOutOf = (one: LeftOut) => ({ key: one.key, why: noteText(one.why, one.why_code, one.why_params) });

/** Restore rows that another tool changed in ROM, or accept the new values. */
function driftChange(uid: string): ChangeRequest {
  const path = { uid };
  return {
    kind: "drift",
    save: "optional",
    quick: true,
    facts: uid,
    other: () => callApi("DELETE", "/servos/{uid}/drift", { path }),
    plan: async opts => {
      const { rows } = await callApi("GET", "/servos/{uid}/drift", { path });
      const changes = rows.map(row => ({ key: row.key, now: row.now, next: row.was, doubt: !row.proved }));
      if (rows.length === 0) return [];
      const body = {
        values: Object.fromEntries(rows.map(row => [row.key, row.was])),
        ...opts,
        dry_run: true,
      };
      // Values that cannot be restored can still be accepted.
      const [part] = await each([uid], async () =>
        plannedPart(uid, await send("PATCH", "/servos/{uid}/parameters", { path, body }), opts.save),
      );
      return part ? [{ ...part, changes, rom: [], unchanged: 0 }] : [];
    },
    run: async (opts, _, report) => {
      await followWrite(
        uid,
        await send("POST", "/servos/{uid}/drift/restore", { path, body: opts, timeout_ms: 60_000 }),
        report,
      );
    },
  };
}

export function openDrift(uid: string): void {
  void openChange(driftChange(uid)).look();
}

/** One servo in the result of a job of kind "profile". */
interface Applied extends SavePreview {
  uid: string;
  outcome: string;
  changes: Change[];
  left_out: LeftOut[];
  saved: boolean;
  problem: ProblemBody | null;
}

export interface ProfileFacts {
  name: string;
  chosen: Signal<ReadonlySet<string>>;
  /** The others continue if one fails. */
  goOn: Signal<boolean>;
}

/** A profile for servos that are chosen in the dialog. */
export function profileChange(
  { name }: Profile,
  uids: readonly string[] = [],
): ChangeRequest & { facts: ProfileFacts } {
  const facts: ProfileFacts = { name, chosen: signal(new Set(uids)), goOn: signal(false) };
  const options = (opts: PlanOptions, uids: readonly string[], dry_run: boolean) => ({
    path: { name },
    query: dry_run ? { wait: true } : {},
    body: { uids, dry_run, on_anomaly: dry_run || facts.goOn.peek() ? "continue" : "stop", ...opts } as const,
    timeout_ms: 60_000,
  });
  return {
    kind: "profile",
    save: "optional",
    facts,
    plan: async opts => {
      const job = await send("POST", "/profiles/{name}/apply", options(opts, [...facts.chosen.peek()], true));
      return appliedBy(job).map(one => ({
        ...plannedPart(one.uid, one, opts.save),
        leftOut: one.left_out.map(leftOutOf),
        problem: one.problem && asProblem(one.problem),
      }));
    },
    run: async (opts, able, report) => {
      const uids = able.map(one => one.uid);
      const job = await startJob("/profiles/{name}/apply", options(opts, uids, false));
      for (const uid of uids) report(uid, { job });
      const end = await settled(job);
      const results = appliedBy(end);
      for (const uid of uids) {
        report(
          uid,
          turnOf(
            results.find(one => one.uid === uid),
            opts.save,
            end,
          ),
        );
        readSheet(uid);
      }
    },
    ready: () => facts.chosen.value.size > 0,
  };
}

const appliedBy = (job: Job) => (job.result as { servos?: Applied[] } | null)?.servos ?? [];

/** Result of one servo in a job of kind "profile". */
function turnOf(one: Applied | undefined, save: boolean, end: Job): Partial<Turn> {
  const why = one?.problem ? failureText(one.problem) : end.state === "succeeded" ? null : endText(end);
  if (one === undefined || one.outcome === "not_tried") return { state: "left_out", why };
  const count = changed(one.changes).length;
  if (one.outcome !== "applied") {
    return {
      state: "failed",
      count,
      why,
      fault: one.outcome === "rolled_back" ? "rolled_back" : "not_written",
    };
  }
  if (one.problem || (save && !one.saved)) {
    return { state: "failed", count, why, fault: save ? "not_saved" : null };
  }
  return { state: "done", count, saved: one.saved };
}

type Staged = ReadonlyMap<string, ReadonlyMap<string, WantedValue>>;

/** Staged values that may be sent, by servo; servos without any are omitted. */
export function stagedOn(uids: readonly string[]): Map<string, Map<string, WantedValue>> {
  const found = new Map<string, Map<string, WantedValue>>();
  for (const uid of uids) {
    const sheet = sheetOf(uid);
    const values = staged(sheet.drafts.map.value, key => sheet.held(key));
    if (values.size > 0) found.set(uid, values);
  }
  return found;
}

/** Plan or run it. Each servo is all or nothing. */
export async function writeMatrix(
  values: Staged,
  opts: PlanOptions & { dry_run: boolean },
): Promise<BatchOutcome[]> {
  const body = {
    servos: Object.fromEntries([...values].map(([uid, one]) => [uid, Object.fromEntries(one)])),
    revisions: Object.fromEntries([...values.keys()].map(uid => [uid, sheetOf(uid).revision])),
    ...opts,
  };
  const response = await send("PATCH", "/parameters", { body, timeout_ms: 90_000 });
  if (!opts.dry_run) for (const one of response.servos) reportRows(one, values);
  return response.servos;
}

/** Set the outcomes of a servo's rows. */
function reportRows(one: BatchOutcome, values: Staged): void {
  const sheet = sheetOf(one.uid);
  if (one.revision) sheet.takeWritten(one.revision, one.changes);
  if (one.outcome === "applied" || one.outcome === "rolled_back") {
    const failure = one.problem ? failureText(one.problem) : null;
    takeOutcomes(sheet, { outcome: one.outcome, changes: one.changes, failure });
  } else if (one.problem) {
    refuse(sheet, [...(values.get(one.uid)?.keys() ?? [])], asProblem(one.problem));
  }
}

/** Staged values of these servos, in one request. */
export function batchChange(uids: readonly string[]): ChangeRequest {
  const values = stagedOn(uids);
  return {
    kind: "batch",
    save: "optional",
    count: values.size,
    plan: async opts =>
      (await writeMatrix(values, { ...opts, dry_run: true })).map(one => {
        const part = plannedPart(one.uid, one, opts.save);
        return {
          ...part,
          changes: opts.save ? [] : part.changes,
          problem: one.problem ? asProblem(one.problem) : null,
        };
      }),
    run: async (opts, able, report) => {
      const mine = new Map([...values].filter(([uid]) => able.some(one => one.uid === uid)));
      for (const uid of mine.keys()) report(uid, { state: "running" });
      const outcomes = await writeMatrix(mine, { ...opts, dry_run: false });
      await Promise.all(outcomes.map(one => followWrite(one.uid, one, report)));
    },
  };
}

/** Save the RAM of these servos to ROM. */
export function batchSaveChange(uids: readonly string[]): ChangeRequest {
  const online = uids.filter(uid => peekServo(uid)?.online === true);
  return {
    kind: "batch-save",
    save: "always",
    count: online.length,
    plan: ({ confirm }) =>
      each(online, async uid =>
        plannedPart(
          uid,
          await preview("/servos/{uid}/save", { path: { uid }, body: { confirm, dry_run: true } }),
          true,
        ),
      ),
    run: async ({ confirm }, able, report) => {
      await Promise.all(
        able.map(async ({ uid }) => {
          report(uid, { state: "running" });
          try {
            await followSave(
              uid,
              await startJob("/servos/{uid}/save", { path: { uid }, body: { confirm } }),
              [],
              report,
            );
          } catch (error) {
            report(uid, { state: "failed", fault: "not_saved", why: problemText(problemOf(error)) });
          }
        }),
      );
    },
  };
}
