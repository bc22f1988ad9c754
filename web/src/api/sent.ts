/** The last requests of this page, for the API page. */
import { signal } from "@preact/signals";

export interface Sent {
  number: number;
  verb: string;
  /** From the root of the server, with its query. */
  path: string;
  body: unknown;
  /** Media type of a file body; the content is not recorded. */
  file: string | undefined;
  headers: Readonly<Record<string, string>> | undefined;
  /** Time sent, UTC seconds. */
  at: number;
  /** HTTP status; 0 without a response, null while pending. */
  status: number | null;
  took_ms: number | null;
}

/** Record the status of a request; 0 without a response. */
export type OnStatus = (status: number) => void;

/** Most requests recorded, by kind: changes and reads. A page reads far more than it changes. */
const KEPT = 20;

/** Not recorded: typed tokens, and lease heartbeats of this page. */
const MINE = /\/(session|tokens|tickets|leases\/[^/]+)$/;

let count = 0;
const changes = signal<readonly Sent[]>([]);
const reads = signal<readonly Sent[]>([]);

/** The last requests, newest first; `reading` includes reads. */
export function lastSent(reading: boolean): readonly Sent[] {
  if (!reading) return changes.value;
  return [...changes.value, ...reads.value].sort((a, b) => b.number - a.number).slice(0, KEPT);
}

/** Record a request that is sent now. */
export function note(what: Pick<Sent, "verb" | "path" | "body" | "file" | "headers">): OnStatus {
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
