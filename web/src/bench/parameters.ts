/** Known parameters of one servo: readings, revision, outcomes. Staged edits are in `draft.ts`. */
import { batch, type Signal, signal } from "@preact/signals";
import { callApi, Problem, problemOf } from "../api/client";
import type { Change, ProblemBody, Reading, Value } from "../api/types";
import { batched } from "./batched";
import { catalog } from "./catalog";
import { monotonic } from "./clock";
import { Drafts, type Verdict } from "./draft";
import { keepDrafts } from "./draft-store";
import { check } from "./number";
import { spanOf } from "./row-state";

export interface KnownReading extends Reading {
  /** Reading of RAM. For torque mode, `value` is the configuration, because Stop and motion switch RAM. */
  ram: Value;
  /** Time of the read, monotonic; null if never read. */
  readAt: number | null;
}

/** Outcome of the last write of a row; cleared on the next visit. */
export type Outcome =
  | { kind: "pending" }
  | { kind: "failed"; what: string; rest: string }
  | { kind: "clamped"; requested: Value }
  | { kind: "saved"; at: number };

export type WantedValue = boolean | number | string;

/** What the last write changed in RAM, for undo; cleared on the next visit. */
export interface Written {
  at: number;
  /** Start of the servo, monotonic; null if it did not report it. */
  bootAt: number | null;
  changes: readonly Change[];
}

export class Sheet {
  readonly uid: string;
  /** Keys of this servo, in the server's order; null until read. */
  readonly keys = signal<readonly string[] | null>(null);
  readonly problem = signal<Problem | null>(null);
  readonly outcomes = signal<ReadonlyMap<string, Outcome>>(new Map());
  readonly busy = signal<"applying" | "saving" | null>(null);
  /** A problem of the whole sheet rather than of a row. */
  readonly trouble = signal<string | null>(null);
  readonly written: Signal<Written | null> = signal(null);
  readonly drafts = new Drafts((key, typed) => this.#judge(key, typed));
  revision = "";
  #readings = new Map<string, Signal<KnownReading | undefined>>();

  constructor(uid: string) {
    this.uid = uid;
  }

  reading(key: string): Signal<KnownReading | undefined> {
    let one = this.#readings.get(key);
    if (!one) {
      one = signal(undefined);
      this.#readings.set(key, one);
    }
    return one;
  }

  /** The value in RAM, for torque mode the configured one; undefined if never read. */
  held(key: string): Value | undefined {
    const reading = this.reading(key).value;
    return reading?.raw === null ? undefined : reading?.value;
  }

  put(reading: Reading): void {
    const readAt = reading.age_s === null ? null : monotonic() - reading.age_s;
    this.reading(reading.key).value = { ...reading, value: reading.configured, ram: reading.value, readAt };
  }

  /** Take the read-back of a write; effects on other rows arrive over the socket. */
  takeWritten(revision: string, changes: readonly Change[]): void {
    batch(() => {
      this.revision = revision;
      for (const { key, after } of changes) {
        const held = this.reading(key).peek();
        // For torque mode the response contains RAM, which Stop may switch.
        if (held === undefined || after === null || key === "torque_mode") continue;
        this.reading(key).value = { ...held, value: after, ram: after, readAt: monotonic(), stale: false };
      }
    });
  }

  /** Check a typed number against the current range of its row. */
  #judge(key: string, typed: string): Verdict | null {
    const row = catalog.value?.rows.get(key);
    return row?.kind === "number" ? check(typed, spanOf(row, this.reading(key).value)) : null;
  }

  setOutcomes(changes: Iterable<[string, Outcome | null]>): void {
    const next = new Map(this.outcomes.peek());
    for (const [key, outcome] of changes) {
      if (outcome) next.set(key, outcome);
      else next.delete(key);
    }
    this.outcomes.value = next;
  }

  /** Read what the server knows of every row. */
  take(revision: string, parameters: Readonly<Record<string, Reading>>): void {
    batch(() => {
      this.revision = revision;
      for (const reading of Object.values(parameters)) this.put(reading);
      this.keys.value = Object.keys(parameters);
      this.problem.value = null;
    });
  }

  /** Read the server's values; with `refresh` it reads the servo. */
  async load(refresh = false): Promise<void> {
    try {
      const response = await callApi("GET", "/servos/{uid}/parameters", {
        path: { uid: this.uid },
        query: refresh ? { refresh } : {},
      });
      this.take(response.revision, response.parameters);
    } catch (error) {
      this.problem.value = problemOf(error);
    }
  }
}

const sheets = new Map<string, Sheet>();

export function sheetOf(uid: string): Sheet {
  let one = sheets.get(uid);
  if (!one) {
    one = new Sheet(uid);
    keepDrafts(uid, one.drafts);
    sheets.set(uid, one);
  }
  return one;
}

/** Read the rows of these servos in one request. On an error, a servo keeps its last values. */
export async function loadSheets(uids: readonly string[], refresh = false): Promise<void> {
  if (uids.length === 0) return;
  const query = { uids: uids.join(",") };
  const slow = { query: { ...query, refresh }, timeout_ms: 60_000 };
  const response = await callApi("GET", "/parameters", refresh ? slow : { query });
  for (const [uid, column] of Object.entries(response.servos)) {
    const sheet = sheetOf(uid);
    if (column.problem) sheet.problem.value = asProblem(column.problem);
    else sheet.take(column.revision ?? "", column.parameters);
  }
}

export function asProblem(body: ProblemBody): Problem {
  return new Problem(body.code, body.status, body.detail, body as unknown as Record<string, unknown>);
}

/** State of a servo at its last read: while it is unchanged, the socket reports changes. */
const readAs = new Map<string, string>();

/** Read the rows of a servo, batched with other servos. */
export const readSheet = batched(async uids => {
  try {
    await loadSheets(uids);
  } catch (error) {
    for (const uid of uids) sheetOf(uid).problem.value = problemOf(error);
  }
  for (const uid of uids) if (sheetOf(uid).problem.peek() !== null) readAs.delete(uid);
});

/** The same, unless the state is unchanged since the last read. */
export function wantSheet(uid: string, as: string): void {
  if (readAs.get(uid) === as) return;
  readAs.set(uid, as);
  readSheet(uid);
}

const received = new Map<string, { uid: string; reading: Reading }>();
let timer: ReturnType<typeof setTimeout> | undefined;
const FLUSH_MS = 100;

/** A reading from the socket; only opened sheets keep it. */
export function takeReading(uid: string, reading: Reading): void {
  received.set(`${uid}/${reading.key}`, { uid, reading });
  if (timer !== undefined) return;
  timer = setTimeout(() => {
    timer = undefined;
    batch(() => {
      for (const { uid: of, reading: one } of received.values()) sheets.get(of)?.put(one);
    });
    received.clear();
  }, FLUSH_MS);
}

/** "Saved" needs some known ROM values: otherwise silence would look like a promise. */
export function romKnown(one: { uid: string; online: boolean }): boolean {
  const reading = sheetOf(one.uid).reading("angle_limit_cw").value;
  return one.online && reading !== undefined && reading.rom !== null;
}
