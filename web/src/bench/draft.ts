/** Staged edits of one servo: typed text, validity, and undo. */
import { computed, signal } from "@preact/signals";
import type { Value } from "../api/types";
import type { Checked } from "./number";

export type Verdict = { ok: true; value: boolean | number | string } | Extract<Checked, { ok: false }>;

export interface Draft {
  /** As typed; for a choice or switch the value as text. */
  text: string;
  verdict: Verdict;
}

export type DraftMap = ReadonlyMap<string, Draft>;

/** Check a text against its row; null if the row is not numeric or unknown. */
type Judge = (key: string, text: string) => Verdict | null;

export class Drafts {
  readonly #put = signal<DraftMap>(new Map());
  /** Edits with the result of the current check. */
  readonly map = computed<DraftMap>(
    () => new Map([...this.#put.value].map(([key, draft]) => [key, this.#judged(key, draft)])),
  );
  readonly #judge: Judge;
  #undo: { key: string; before: Draft | undefined }[] = [];
  #editing: string | null = null;

  constructor(judge: Judge = () => null) {
    this.#judge = judge;
  }

  get(key: string): Draft | undefined {
    return this.map.value.get(key);
  }

  /** Set a draft. Keystrokes in one box are one undo step, until `commit`. */
  put(key: string, draft: Draft): void {
    if (this.#editing !== key) {
      this.#undo.push({ key, before: this.#put.peek().get(key) });
      this.#editing = key;
    }
    this.#put.value = new Map(this.#put.peek()).set(key, draft);
  }

  /** Restore stored drafts, without an undo step. */
  restore(drafts: DraftMap): void {
    this.#put.value = drafts;
  }

  /** End an edit. A draft equal to RAM is removed. */
  commit(key: string, held: Value | undefined): void {
    this.#editing = null;
    const draft = this.map.peek().get(key);
    if (draft?.verdict.ok && draft.verdict.value === held) this.drop([key]);
  }

  /** Discard what was typed since the box got the focus. No-op before the first key. */
  revert(key: string): void {
    if (this.#editing === key) this.undo();
  }

  #judged(key: string, draft: Draft): Draft {
    const verdict = this.#judge(key, draft.text);
    return verdict === null ? draft : { ...draft, verdict };
  }

  drop(keys: Iterable<string>): void {
    const next = new Map(this.#put.peek());
    let changed = false;
    for (const key of keys) changed = next.delete(key) || changed;
    if (changed) this.#put.value = next;
  }

  clear(): void {
    this.#undo = [];
    this.#editing = null;
    this.#put.value = new Map();
  }

  /** Undo the last edit. Returns its key, or null if there is none. */
  undo(): string | null {
    const last = this.#undo.pop();
    this.#editing = null;
    if (!last) return null;
    const next = new Map(this.#put.peek());
    if (last.before) next.set(last.key, last.before);
    else next.delete(last.key);
    this.#put.value = next;
    return last.key;
  }
}

/** Values that may be sent: valid, and different from RAM. */
export function staged(
  drafts: DraftMap,
  held: (key: string) => Value | undefined,
): Map<string, boolean | number | string> {
  const values = new Map<string, boolean | number | string>();
  for (const [key, draft] of drafts) {
    if (draft.verdict.ok && draft.verdict.value !== held(key)) values.set(key, draft.verdict.value);
  }
  return values;
}

/** Keys with invalid text. */
export function wrong(drafts: DraftMap): string[] {
  return [...drafts].filter(([, draft]) => !draft.verdict.ok).map(([key]) => key);
}
