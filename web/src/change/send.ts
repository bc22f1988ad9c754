/** Sends changes idempotently, and follows the jobs they start. */
import { type ApiResponse, type CallOptions, callApi, type PathOf } from "../api/client";
import type { SavePreview } from "../api/config-types";
import type { Change, Job, ProblemBody } from "../api/types";
import { endText, failureText } from "../bench/facts";
import { peekServo } from "../bench/fleet";
import { jobs, setJob, settled } from "../bench/jobs";
import { sheetOf } from "../bench/parameters";
import type { Part, Report, RowChange, Turn } from "./flow";

/** Send a write or its dry run. A POST that acts is executed once, even if sent again. */
export function send<V extends "POST" | "PATCH", P extends PathOf<V>>(
  verb: V,
  path: P,
  options: CallOptions<V, P>,
): Promise<ApiResponse<V, P>> {
  const { body, headers } = options as { body?: { dry_run?: boolean } | null; headers?: object };
  const once =
    verb === "POST" && !body?.dry_run
      ? { "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}` }
      : {};
  return callApi(verb, path, { timeout_ms: 30_000, ...options, headers: { ...headers, ...once } });
}

/** Request the plan of a POST whose body marks a dry run. */
export async function preview<P extends PathOf<"POST">>(
  path: P,
  options: CallOptions<"POST", P>,
): Promise<Exclude<ApiResponse<"POST", P>, Job>> {
  return (await send("POST", path, options)) as Exclude<ApiResponse<"POST", P>, Job>;
}

/** Start a job; returns its ID. */
export async function startJob<P extends PathOf<"POST">>(
  path: P,
  options: CallOptions<"POST", P>,
): Promise<string> {
  const job = (await send("POST", path, options)) as Job;
  // State from the socket is newer than this response.
  if (!jobs.peek().has(job.id)) setJob(job);
  return job.id;
}

export function changed(changes: readonly Change[]): Change[] {
  return changes.filter(one => one.verdict !== "unchanged");
}

/** Response to a write of rows, or to its dry run. */
interface Written extends SavePreview {
  outcome: string;
  changes: readonly Change[];
  failure?: string | null;
  problem?: ProblemBody | null;
  job?: string | null;
}

/** One servo of a plan, from the response to a dry run. */
export function plannedPart(uid: string, response: Partial<Written>, save: boolean): Part {
  const changes = changed(response.changes ?? []);
  return {
    uid,
    changes: changes.map(one => ({ key: one.key, now: one.before, next: one.requested })),
    unchanged: (response.changes?.length ?? 0) - changes.length,
    ...(save
      ? {
          rom: romOf(response),
          unknown: response.rom_unknown?.length ?? 0,
          restart: response.restart ?? null,
        }
      : {}),
  };
}

function romOf(response: Partial<SavePreview>): RowChange[] {
  return (response.rom_changes ?? []).map(one => ({ key: one.key, now: one.before, next: one.after }));
}

/** Report the result of a write to one servo, and follow the save it started. Returns why it was not saved, or null. */
export async function followWrite(
  uid: string,
  response: Written,
  report: Report,
  turn = uid,
  keys: readonly string[] = response.changes.map(one => one.key),
): Promise<string | null> {
  const count = changed(response.changes).length;
  const why = response.problem ? failureText(response.problem) : (response.failure ?? "");
  const failed = (fault: Turn["fault"]) => report(turn, { state: "failed", fault, count, why });
  if (response.outcome === "rolled_back") failed("rolled_back");
  else if (response.outcome !== "applied") failed("not_written");
  else if (response.job) {
    report(turn, { count });
    return followSave(uid, response.job, keys, report, turn);
  } else if (why !== "") {
    failed("not_saved");
    return why;
  } else report(turn, { state: "done", count });
  return null;
}

/** Wait for a save, mark its rows, and report its end. */
export async function followSave(
  uid: string,
  job: string,
  keys: readonly string[],
  report: Report,
  turn = uid,
): Promise<string | null> {
  report(turn, { state: "running", job });
  const rows = new Set([...keys, ...(peekServo(uid)?.unsaved ?? [])]);
  const end = await settled(job);
  // Current value in ROM.
  await sheetOf(uid).load();
  if (end.state !== "succeeded") {
    report(turn, { state: "failed", fault: "not_saved", why: endText(end) });
    return endText(end);
  }
  const at = end.ended_at ?? Date.now() / 1000;
  const left = new Set(peekServo(uid)?.unsaved ?? []);
  const saved = [...rows].filter(key => !left.has(key));
  sheetOf(uid).setOutcomes(saved.map(key => [key, { kind: "saved", at }]));
  report(turn, { state: "done", saved: true });
  return null;
}

/** Follow the job that handles all servos. */
export async function followTogether(job: string, report: Report): Promise<Job> {
  report("", { state: "running", job });
  const end = await settled(job);
  const well = end.state === "succeeded";
  report("", well ? { state: "done" } : { state: "failed", why: end.error ? failureText(end.error) : null });
  return end;
}
