/** The last requests of this page, for its API page to show. */
import { signal } from "@preact/signals";

export interface Sent {
  number: number;
  verb: string;
  /** From the root of the server, with its query. */
  path: string;
  body: unknown;
  /** The type of a file that was the body; its content is not kept. */
  file: string | undefined;
  headers: Readonly<Record<string, string>> | undefined;
  /** When it was sent, UTC seconds. */
  at: number;
  /** The server's status; 0 without an answer, null while there is none yet. */
  status: number | null;
  took_ms: number | null;
}

/** Tells what came of a request; 0: no answer. */
export type Answered = (status: number) => void;

/** Kept of each: what changes something, and what only reads. A page reads far more than it changes. */
const KEPT = 20;

/** Of no use to anybody else: a token that was typed in, and the heart-beat of a lease of this page. */
const MINE = /\/(session|tokens|tickets|leases\/[^/]+)$/;

let count = 0;
const changes = signal<readonly Sent[]>([]);
const reads = signal<readonly Sent[]>([]);

/** The last requests, newest first; `reading` with those that changed nothing. */
export function lastSent(reading: boolean): readonly Sent[] {
  if (!reading) return changes.value;
  return [...changes.value, ...reads.value].sort((a, b) => b.number - a.number).slice(0, KEPT);
}

/** Keeps a request that goes out now. */
export function note(what: Pick<Sent, "verb" | "path" | "body" | "file" | "headers">): Answered {
  if (MINE.test(what.path)) return () => {};
  const ring = what.verb === "GET" ? reads : changes;
  const number = ++count;
  const began = performance.now();
  const entry: Sent = { ...what, number, at: Date.now() / 1000, status: null, took_ms: null };
  ring.value = [entry, ...ring.peek()].slice(0, KEPT);
  return status => {
    const took_ms = performance.now() - began;
    ring.value = ring.peek().map(one => (one.number === number ? { ...one, status, took_ms } : one));
  };
}
