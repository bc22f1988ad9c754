/** The question before a factory reset: what the horn does, every row that changes, and the servo's name to type. */

import { useSignal } from "@preact/signals";
import { useId } from "preact/hooks";
import { problemOf } from "../api/client";
import type { ResetPreview } from "../api/config-types";
import { problemText } from "../bench/facts";
import { type KnownServo, nameOf } from "../bench/fleet";
import { NONE } from "../bench/format";
import { valueText } from "../bench/row-text";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { restarting as words } from "../text/topics";
import { BeforeAfter } from "./before-after";
import { HornForecast } from "./horn-forecast";
import { HornFreeTick, useHornFree } from "./horn-free";
import { ServoJobDialog } from "./servo-job-dialog";
import { planReset, runInTurn } from "./servo-jobs";
import "./restarting.css";

const said = words.reset;

interface Props {
  one: KnownServo;
  /** With the identity kept, as the server has just answered. */
  plan: ResetPreview;
  onClose: () => void;
}

export function ResetDialog({ one, plan: first, onClose }: Props) {
  const plan = useSignal(first);
  const keep = useSignal(true);
  const planning = useSignal(false);
  const refused = useSignal<string | null>(null);
  const free = useHornFree([{ uid: one.uid, moves: plan.value.restart.moves }]);
  const typed = useSignal("");
  const going = useSignal(false);
  const box = useId();
  if (going.value) return <ServoJobDialog onClose={onClose} />;
  const name = nameOf(one);
  const { changes, restart } = plan.value;
  const choose = async (keeps: boolean) => {
    planning.value = true;
    refused.value = null;
    try {
      plan.value = await planReset(one.uid, keeps);
      keep.value = keeps;
    } catch (error) {
      refused.value = words.refused(problemText(problemOf(error)));
    }
    planning.value = false;
  };
  const ready = typed.value.trim() === name && free.agreed && !planning.value;
  return (
    <Dialog
      title={said.title(name)}
      subtitle={words.facts(one.model ?? NONE, one.serial ?? NONE, String(one.servo_id ?? NONE))}
      testid="reset-dialog"
      onClose={onClose}
      foot={
        <>
          {planning.value && (
            <span class="k-intent working">
              <Spinner /> {words.planning}
            </span>
          )}
          <span class="grow" />
          <span data-first-focus>
            <Button onClick={onClose}>{text.cancel}</Button>
          </span>
          <Button
            look="danger"
            live
            testid="reset-go"
            disabled={!ready}
            onClick={() => {
              going.value = true;
              void runInTurn("factory-reset", [one.uid], { keep_identity: keep.peek() });
            }}
          >
            {said.go(name)}
          </Button>
        </>
      }
    >
      {refused.value !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {refused.value}
        </p>
      )}
      <HornForecast one={one} forecast={restart} verb="factory-reset" />
      <label class="tick">
        <input
          type="checkbox"
          data-testid="reset-keep"
          checked={keep.value}
          disabled={planning.value}
          onChange={event => void choose(event.currentTarget.checked)}
        />
        {said.keep(
          valueText("servo_id", first.kept.servo_id),
          first.kept.node_id === 0 ? said.dynamicNode : said.node(valueText("node_id", first.kept.node_id)),
          valueText("origin", first.kept.origin),
        )}
      </label>
      {!keep.value && <p class="second">{said.identityGoes}</p>}
      {changes.length === 0 ? (
        <p>{said.nothing}</p>
      ) : (
        <details class="reset-changes" open={changes.length <= 6}>
          <summary data-testid="reset-count">{said.changes(changes.length)}</summary>
          <BeforeAfter
            head={said.head}
            changes={changes.map(each => ({ key: each.key, now: each.before, next: each.requested }))}
            testid="reset"
          />
        </details>
      )}
      <HornFreeTick of={free} />
      <p class="small second">{said.snapshot}</p>
      <div class="type-name">
        <label for={box}>{said.type(name)}</label>
        <input
          id={box}
          class="field"
          data-testid="reset-name"
          autocomplete="off"
          spellcheck={false}
          value={typed.value}
          onInput={event => {
            typed.value = event.currentTarget.value;
          }}
        />
      </div>
    </Dialog>
  );
}
