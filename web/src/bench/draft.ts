/** The staged edits of one servo: what was typed, whether it may be sent, and undo. */
import { signal } from "@preact/signals";
import type { Value } from "../api/types";
import type { Checked } from "./number";

export type Verdict = { ok: true; value: boolean | number | string } | Extract<Checked, { ok: false }>;

export interface Draft {
  /** As typed; for a choice or a switch its value in words. */
  text: string;
  verdict: Verdict;
}

export type DraftMap = ReadonlyMap<string, Draft>;

export class Drafts {
  readonly map = signal<DraftMap>(new Map());
  #undo: { key: string; before: Draft | undefined }[] = [];
  #editing: string | null = null;

  get(key: string): Draft | undefined {
    return this.map.value.get(key);
  }

  /** Puts a draft. Keystrokes in the same box are one step of undo, until `commit`. */
  put(key: string, draft: Draft): void {
    if (this.#editing !== key) {
      this.#undo.push({ key, before: this.map.peek().get(key) });
      this.#editing = key;
    }
    this.map.value = new Map(this.map.peek()).set(key, draft);
  }

  /** Judges a text anew, for its row allows other values now. No edit: there is nothing to undo. */
  judge(key: string, verdict: Verdict): void {
    const draft = this.map.peek().get(key);
    if (!draft || JSON.stringify(draft.verdict) === JSON.stringify(verdict)) return;
    this.map.value = new Map(this.map.peek()).set(key, { text: draft.text, verdict });
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

  drop(keys: Iterable<string>): void {
    const next = new Map(this.map.peek());
    let changed = false;
    for (const key of keys) changed = next.delete(key) || changed;
    if (changed) this.map.value = next;
  }

  clear(): void {
    this.#undo = [];
    this.#editing = null;
    this.map.value = new Map();
  }

  /** Takes the last edit back; answers its key, or null when there is none. */
  undo(): string | null {
    const last = this.#undo.pop();
    this.#editing = null;
    if (!last) return null;
    const next = new Map(this.map.peek());
    if (last.before) next.set(last.key, last.before);
    else next.delete(last.key);
    this.map.value = next;
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
