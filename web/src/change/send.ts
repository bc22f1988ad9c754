/** Sends changes idempotently, and follows the jobs they start. */
import { type Answer, type AskOptions, ask, type PathOf } from "../api/client";
import type { SavePreview } from "../api/config-types";
import type { Change, Job, ProblemBody } from "../api/types";
import { endText, failureText } from "../bench/facts";
import { peekServo } from "../bench/fleet";
import { jobs, setJob, settled } from "../bench/jobs";
import { sheetOf } from "../bench/parameters";
import type { Part, RowChange, Tell, Turn } from "./flow";

/** Send a write or its dry run. A POST that acts is executed once, even if sent again. */
export function send<V extends "POST" | "PATCH", P extends PathOf<V>>(
  verb: V,
  path: P,
  options: AskOptions<V, P>,
): Promise<Answer<V, P>> {
  const { body, headers } = options as { body?: { dry_run?: boolean } | null; headers?: object };
  const once =
    verb === "POST" && !body?.dry_run
      ? { "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}` }
      : {};
  return ask(verb, path, { timeout_ms: 30_000, ...options, headers: { ...headers, ...once } });
}

/** Request the plan of a POST whose body marks a dry run. */
export async function preview<P extends PathOf<"POST">>(
  path: P,
  options: AskOptions<"POST", P>,
): Promise<Exclude<Answer<"POST", P>, Job>> {
  return (await send("POST", path, options)) as Exclude<Answer<"POST", P>, Job>;
}

/** Start a job; returns its ID. */
export async function startJob<P extends PathOf<"POST">>(
  path: P,
  options: AskOptions<"POST", P>,
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
export function plannedPart(uid: string, answer: Partial<Written>, save: boolean): Part {
  const changes = changed(answer.changes ?? []);
  return {
    uid,
    changes: changes.map(one => ({ key: one.key, now: one.before, next: one.requested })),
    unchanged: (answer.changes?.length ?? 0) - changes.length,
    ...(save
      ? {
          rom: romOf(answer),
          unknown: answer.rom_unknown?.length ?? 0,
          restart: answer.restart ?? null,
        }
      : {}),
  };
}

function romOf(answer: Partial<SavePreview>): RowChange[] {
  return (answer.rom_changes ?? []).map(one => ({ key: one.key, now: one.before, next: one.after }));
}

/** Report the result of a write to one servo, and follow the save it started. Returns why it was not saved, or null. */
export async function followWrite(
  uid: string,
  answer: Written,
  tell: Tell,
  turn = uid,
  keys: readonly string[] = answer.changes.map(one => one.key),
): Promise<string | null> {
  const count = changed(answer.changes).length;
  const why = answer.problem ? failureText(answer.problem) : (answer.failure ?? "");
  const failed = (fault: Turn["fault"]) => tell(turn, { state: "failed", fault, count, why });
  if (answer.outcome === "rolled_back") failed("rolled_back");
  else if (answer.outcome !== "applied") failed("not_written");
  else if (answer.job) {
    tell(turn, { count });
    return followSave(uid, answer.job, keys, tell, turn);
  } else if (why !== "") {
    failed("not_saved");
    return why;
  } else tell(turn, { state: "done", count });
  return null;
}

/** Wait for a save, mark its rows, and report its end. */
export async function followSave(
  uid: string,
  job: string,
  keys: readonly string[],
  tell: Tell,
  turn = uid,
): Promise<string | null> {
  tell(turn, { state: "running", job });
  const rows = new Set([...keys, ...(peekServo(uid)?.unsaved ?? [])]);
  const end = await settled(job);
  // Current value in ROM.
  await sheetOf(uid).load();
  if (end.state !== "succeeded") {
    tell(turn, { state: "failed", fault: "not_saved", why: endText(end) });
    return endText(end);
  }
  const at = end.ended_at ?? Date.now() / 1000;
  const left = new Set(peekServo(uid)?.unsaved ?? []);
  const saved = [...rows].filter(key => !left.has(key));
  sheetOf(uid).setOutcomes(saved.map(key => [key, { kind: "saved", at }]));
  tell(turn, { state: "done", saved: true });
  return null;
}

/** Follow the job that handles all servos. */
export async function followTogether(job: string, tell: Tell): Promise<Job> {
  tell("", { state: "running", job });
  const end = await settled(job);
  const well = end.state === "succeeded";
  tell("", well ? { state: "done" } : { state: "failed", why: end.error ? failureText(end.error) : null });
  return end;
}
