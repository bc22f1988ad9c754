/** The staged edits of one servo: what was typed, whether it may be sent, and undo. */
import { computed, signal } from "@preact/signals";
import type { Value } from "../api/types";
import type { Checked } from "./number";

export type Verdict = { ok: true; value: boolean | number | string } | Extract<Checked, { ok: false }>;

export interface Draft {
  /** As typed; for a choice or a switch its value in words. */
  text: string;
  verdict: Verdict;
}

export type DraftMap = ReadonlyMap<string, Draft>;

/** What a text is worth in its row; null where the row is no number, or not known yet. */
type Judge = (key: string, text: string) => Verdict | null;

export class Drafts {
  readonly #put = signal<DraftMap>(new Map());
  /** Each with the verdict of what its row allows now. */
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

  /** Puts a draft. Keystrokes in the same box are one step of undo, until `commit`. */
  put(key: string, draft: Draft): void {
    if (this.#editing !== key) {
      this.#undo.push({ key, before: this.#put.peek().get(key) });
      this.#editing = key;
    }
    this.#put.value = new Map(this.#put.peek()).set(key, draft);
  }

  /** Puts back what was kept; there is nothing to undo. */
  restore(drafts: DraftMap): void {
    this.#put.value = drafts;
  }

  /** Ends an edit; a draft equal to what RAM holds is none. */
  commit(key: string, held: Value | undefined): void {
    this.#editing = null;
    const draft = this.map.peek().get(key);
    if (draft?.verdict.ok && draft.verdict.value === held) this.drop([key]);
  }

  /** Takes back what was typed since the box was entered; before the first key there is nothing to take back. */
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

  /** Takes the last edit back; answers its key, or null when there is none. */
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

/** The values that may be sent: legal, and different from what RAM holds. */
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

/** The keys whose text is no legal value. */
export function wrong(drafts: DraftMap): string[] {
  return [...drafts].filter(([, draft]) => !draft.verdict.ok).map(([key]) => key);
}
