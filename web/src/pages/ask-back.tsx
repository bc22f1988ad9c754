/** Owns the question before a write that the server wants confirmed: what could happen, and one tick for it. */
import { type Signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Problem } from "../api/client";
import type { SafetyWord } from "../api/config-types";
import { withUnit } from "../form/format";
import { labelOf, valueText } from "../form/row-text";
import { toConfirm } from "../state/records";
import { text } from "../text";
import { editing } from "../text/topics";
import { Button } from "../ui/button";
import { Dialog } from "../ui/dialog";
import { Glyph } from "../ui/glyph";
import { ConfirmTicks } from "./confirm-ticks";

const said = editing.confirm;

/** A question that waits for its answer. */
export interface Question {
  problem: Problem;
  answer: (word: SafetyWord | null) => void;
}

/** Puts a question where `AskBack` looks for it, and waits. */
export function asking(open: Signal<Question | null>): (problem: Problem) => Promise<SafetyWord | null> {
  return problem =>
    new Promise(resolve => {
      open.value = {
        problem,
        answer: word => {
          open.value = null;
          resolve(word);
        },
      };
    });
}

/** What could happen, from the facts of the refusal; the server's own sentence where they do not say. */
export function dangerOf(problem: Problem): string {
  const { key, requested, reading, margin, unit, confirm } = problem.facts;
  if (typeof key !== "string" || typeof requested !== "number") return problem.message;
  const row = labelOf(key);
  const wanted = valueText(key, requested);
  if (typeof reading !== "number") return said.unknown(row, wanted);
  const seen = withUnit(String(reading), String(unit));
  const about = withUnit(String(margin), String(unit));
  if (confirm === "supply") return said.supply(row, wanted, seen, about);
  return confirm === "temperature" ? said.temperature(row, wanted, seen, about) : problem.message;
}

interface Props {
  name: string;
  count: number;
  question: Question;
}

export function AskBackDialog({ name, count, question }: Props) {
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const word = toConfirm(question.problem);
  const { answer } = question;
  // A page that is left answers no.
  useEffect(() => () => answer(null), [question]);
  return (
    <Dialog
      title={said.title(name)}
      subtitle={said.lead}
      testid="ask-back"
      onClose={() => answer(null)}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={() => answer(null)}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="ask-back-go"
            disabled={word === null || !agreed.value.includes(word)}
            onClick={() => answer(word)}
          >
            {said.go(count)}
          </Button>
        </>
      }
    >
      <p class="asked-back">
        <Glyph kind="warning" size={18} />
        <span>{dangerOf(question.problem)}</span>
      </p>
      {word !== null && <ConfirmTicks needed={[word]} agreed={agreed} sentences={said.ticks} />}
    </Dialog>
  );
}
