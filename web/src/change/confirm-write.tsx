/** The question before a write that the server wants confirmed: what could happen, and one tick for it. */
import { type Signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Problem } from "../api/client";
import type { SafetyWord } from "../api/config-types";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { text } from "../text";
import { editing } from "../text/topics";
import type { AskBack } from "./apply";
import { ConfirmTicks } from "./confirm-ticks";
import { dangerOf } from "./consequences";
import { wordsOf } from "./safety-words";

const said = editing.confirm;

/** A question that waits for its answer. */
export interface WriteQuestion {
  problem: Problem;
  answer: (word: SafetyWord | null) => void;
}

/** Puts a question where `AskBack` looks for it, and waits. */
export function askingIn(open: Signal<WriteQuestion | null>): AskBack {
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

interface Props {
  name: string;
  count: number;
  question: WriteQuestion;
}

export function AskBackDialog({ name, count, question }: Props) {
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const words = wordsOf(question.problem);
  const choice = words.length > 1;
  const { answer } = question;
  const chosen = agreed.value[0];
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
            disabled={chosen === undefined}
            onClick={() => answer(chosen ?? null)}
          >
            {words.some(one => one.startsWith("torque")) ? said.next : said.go(count)}
          </Button>
        </>
      }
    >
      <p class="asked-back">
        <Glyph kind="warning" size={18} />
        <span>{dangerOf(question.problem)}</span>
      </p>
      {choice ? (
        <fieldset class="ask-choices">
          {words.map(one => (
            <label key={one} class="tick">
              <input
                type="radio"
                name="ask-back"
                data-testid={`ask-back-${one}`}
                checked={chosen === one}
                onChange={() => {
                  agreed.value = [one];
                }}
              />
              {said.choices[one]}
            </label>
          ))}
        </fieldset>
      ) : (
        <ConfirmTicks needed={words} agreed={agreed} sentences={said.ticks} />
      )}
    </Dialog>
  );
}
