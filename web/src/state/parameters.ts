/** Owns what is known of one servo's parameters beside what is staged: readings, revision, outcomes. */
import { batch, type Signal, signal } from "@preact/signals";
import { ask, type Problem, problemOf } from "../api/client";
import type { Parameters, Reading, Value } from "../api/types";
import { monotonic } from "./clock";
import { Drafts } from "./draft";

export interface KnownReading extends Reading {
  /** Our monotonic time at which it was read; null while never read. */
  readAt: number | null;
}

/** What became of the last attempt to write a row; gone on the next visit. */
export type Outcome =
  | { kind: "pending" }
  | { kind: "failed"; what: string; rest: string }
  | { kind: "clamped"; asked: Value }
  | { kind: "saved"; at: number };

export class Sheet {
  readonly uid: string;
  /** Keys this servo has, in the server's order; null until read. */
  readonly keys = signal<readonly string[] | null>(null);
  readonly problem = signal<Problem | null>(null);
  readonly outcomes = signal<ReadonlyMap<string, Outcome>>(new Map());
  readonly busy = signal<"applying" | "saving" | null>(null);
  readonly drafts = new Drafts();
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

  /** The value in RAM; undefined while never read. */
  held(key: string): Value | undefined {
    const reading = this.reading(key).value;
    return reading?.raw === null ? undefined : reading?.value;
  }

  put(reading: Reading): void {
    const readAt = reading.age_s === null ? null : monotonic() - reading.age_s;
    this.reading(reading.key).value = { ...reading, readAt };
  }

  setOutcomes(changes: Iterable<[string, Outcome | null]>): void {
    const next = new Map(this.outcomes.peek());
    for (const [key, outcome] of changes) {
      if (outcome) next.set(key, outcome);
      else next.delete(key);
    }
    this.outcomes.value = next;
  }

  /** What the server knows of every row, asked for by whoever has it. */
  take(revision: string, parameters: Readonly<Record<string, Reading>>): void {
    batch(() => {
      this.revision = revision;
      for (const reading of Object.values(parameters)) this.put(reading);
      this.keys.value = Object.keys(parameters);
      this.problem.value = null;
    });
  }

  /** Reads what the server knows; with `refresh` it asks the bus. */
  async load(refresh = false): Promise<void> {
    try {
      const answer = await ask<Parameters>(
        "GET",
        `/servos/${this.uid}/parameters${refresh ? "?refresh=true" : ""}`,
      );
      this.take(answer.revision, answer.parameters);
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
    sheets.set(uid, one);
  }
  return one;
}

const heard = new Map<string, { uid: string; reading: Reading }>();
let timer: ReturnType<typeof setTimeout> | undefined;
const FLUSH_MS = 100;

/** A reading told over the socket; only sheets somebody has opened keep it. */
export function hear(uid: string, reading: Reading): void {
  heard.set(`${uid}/${reading.key}`, { uid, reading });
  if (timer !== undefined) return;
  timer = setTimeout(() => {
    timer = undefined;
    batch(() => {
      for (const { uid: of, reading: one } of heard.values()) sheets.get(of)?.put(one);
    });
    heard.clear();
  }, FLUSH_MS);
}
