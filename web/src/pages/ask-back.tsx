/** Owns the question before a write that the server wants confirmed: what could happen, and one tick for it. */
import { type Signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Problem } from "../api/client";
import type { SafetyWord } from "../api/config-types";
import { dangerOf } from "../form/danger";
import type { Agreed, AskBack } from "../state/apply";
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
  answer: (word: Agreed | null) => void;
}

/** Puts a question where `AskBack` looks for it, and waits. */
export function asking(open: Signal<Question | null>): AskBack {
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
  question: Question;
}

export function AskBackDialog({ name, count, question }: Props) {
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const free = useSignal(false);
  const word = toConfirm(question.problem);
  const saves = word === "torque_off_in_rom";
  const { answer } = question;
  // A page that is left answers no.
  useEffect(() => () => answer(null), [question]);
  return (
    <Dialog
      title={said.title(name)}
      subtitle={saves ? said.notSaved : said.lead}
      testid="ask-back"
      onClose={() => answer(null)}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={() => answer(null)}>{text.cancel}</Button>
          </span>
          <Button
            look={saves ? "plain" : "primary"}
            live
            testid="ask-back-go"
            disabled={word === null || !agreed.value.includes(word)}
            onClick={() => answer(word)}
          >
            {saves ? said.goSave : said.go(count)}
          </Button>
          {saves && (
            <Button
              look="primary"
              live
              testid="ask-back-torque"
              disabled={!free.value}
              onClick={() => answer("torque_on")}
            >
              {said.goTorque}
            </Button>
          )}
        </>
      }
    >
      <p class="asked-back">
        <Glyph kind="warning" size={18} />
        <span>{dangerOf(question.problem)}</span>
      </p>
      {saves && (
        <label class="tick">
          <input
            type="checkbox"
            data-testid="ask-back-free"
            checked={free.value}
            onChange={event => {
              free.value = event.currentTarget.checked;
            }}
          />
          {said.free}
        </label>
      )}
      {word !== null && <ConfirmTicks needed={[word]} agreed={agreed} sentences={said.ticks} />}
    </Dialog>
  );
}
