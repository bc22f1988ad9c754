/** What the Records page asks for: something read once, again when told, with its problem in words. */

import { type Signal, signal } from "@preact/signals";
import { problemOf } from "../api/client";
import type { Job } from "../api/types";
import { endText, problemText } from "./facts";
import { settled } from "./jobs";

/** Something to be asked for: null until it is there. The newest question wins. */
export class Asked<T> {
  readonly value: Signal<T | null> = signal(null);
  readonly problem: Signal<string | null> = signal(null);
  #round = 0;

  async load(look: () => Promise<T>): Promise<void> {
    const round = ++this.#round;
    try {
      const found = await look();
      if (round !== this.#round) return;
      this.value.value = found;
      this.problem.value = null;
    } catch (error) {
      if (round === this.#round) this.problem.value = problemText(problemOf(error));
    }
  }

  forget(): void {
    this.#round += 1;
    this.value.value = null;
    this.problem.value = null;
  }
}

/** Waits for the save that a write has started. Null when all went well, or why not. */
export async function saved(job: string): Promise<string | null> {
  const end: Job = await settled(job);
  return end.state === "succeeded" ? null : endText(end);
}

/** The address of an audit with these filters; empty ones are left out. */
export function auditQuery(filters: Readonly<Record<string, string | null>>): string {
  const query = new URLSearchParams(
    Object.entries(filters).flatMap(([name, value]) => (value ? [[name, value]] : [])),
  );
  const plain = query.toString();
  return plain === "" ? "" : `?${plain}`;
}

/** "snapshots/<uid>": which part, and of which servo. */
export function partOf<T extends string>(hash: string, parts: readonly T[]): { part: T; uid: string | null } {
  const [name, uid] = hash.split("/");
  const part = parts.find(one => one === name) ?? (parts[0] as T);
  return { part, uid: uid !== undefined && /^[0-9a-f]{32}$/.test(uid) ? uid : null };
}

/** A name for a profile from that of its file. */
export function nameFromFile(file: string): string {
  return file
    .replace(/\.(toml|json)$/i, "")
    .replace(/[/\\]/g, " ")
    .trim()
    .slice(0, 80);
}

/** The form a file is in, by its name; null for one that is neither. */
export function typeOfFile(file: string): "application/json" | "application/toml" | null {
  if (/\.toml$/i.test(file)) return "application/toml";
  return /\.json$/i.test(file) ? "application/json" : null;
}
