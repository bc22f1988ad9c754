/** A dry run before a confirmation: the dialog opens only once the server has checked everything and refused nothing. */

import { signal } from "@preact/signals";
import { problemOf } from "../api/client";
import type { SafetyWord } from "../api/config-types";
import { problemText } from "../bench/facts";
import type { AskBack } from "./apply";
import { wordsOf } from "./safety-words";

export class DryRun<T> {
  /** What the server would do; while it is here, the dialog is open. */
  readonly plan = signal<T | null>(null);
  readonly busy = signal(false);
  /** Why it was refused, with the remedy: shown where the button is. */
  readonly problem = signal<string | null>(null);
  /** What was agreed to on the way; the real request brings it, too. */
  confirm: readonly SafetyWord[] = [];

  /** Asks, again with each word that somebody agrees to. A no leaves everything as it is. */
  async open(look: (confirm: readonly SafetyWord[]) => Promise<T>, askBack?: AskBack): Promise<void> {
    if (this.busy.peek()) return;
    this.busy.value = true;
    this.problem.value = null;
    this.plan.value = null;
    this.confirm = [];
    try {
      this.plan.value = await this.#agreed(look, askBack);
    } catch (error) {
      this.problem.value = problemText(problemOf(error));
    } finally {
      this.busy.value = false;
    }
  }

  async #agreed(
    look: (confirm: readonly SafetyWord[]) => Promise<T>,
    askBack: AskBack | undefined,
  ): Promise<T | null> {
    for (;;) {
      try {
        return await look(this.confirm);
      } catch (error) {
        const problem = problemOf(error);
        const asked = wordsOf(problem);
        if (askBack === undefined || !asked.some(word => !this.confirm.includes(word))) throw error;
        const word = await askBack(problem);
        if (word === null) return null;
        this.confirm = [...this.confirm, word];
      }
    }
  }

  close(): void {
    this.plan.value = null;
  }
}
