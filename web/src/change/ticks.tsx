/** Confirmations before a change: those the server requires, a requested save, and that horns can turn freely. */
import type { Signal } from "@preact/signals";
import type { SafetyWord } from "../api/config-types";
import { nameOf, servo } from "../bench/fleet";
import { cell, Tick } from "../kit/field";
import type { ChangeFlow } from "./flow";
import { hornLine } from "./horn-forecast";
import type { HornFree } from "./horn-free";
import { withTick } from "./safety-words";
import { changing, editing, saving } from "./words";

interface SafetyProps {
  requested: readonly SafetyWord[];
  agreed: Signal<readonly SafetyWord[]>;
  disabled: boolean;
}

/** A check box per word; exclusive words are radio buttons. */
export function SafetyTicks({ requested, agreed, disabled }: SafetyProps) {
  const { ticks, choices } = editing.confirm;
  const choice = requested.filter(word => word in choices);
  const choose = (word: SafetyWord, on: boolean) => {
    agreed.value = withTick(agreed.peek(), word, on);
  };
  return (
    <>
      {choice.length > 1 && (
        <fieldset class="confirmations">
          {choice.map(word => (
            <label key={word} class="tick">
              <input
                type="radio"
                name="safety"
                data-testid={`confirm-${word}`}
                checked={agreed.value.includes(word)}
                disabled={disabled}
                onChange={() => choose(word, true)}
              />
              {choices[word]}
            </label>
          ))}
        </fieldset>
      )}
      {requested
        .filter(word => choice.length < 2 || !choice.includes(word))
        .map(word => (
          <Tick
            key={word}
            at={cell(agreed.value.includes(word), on => choose(word, on))}
            label={ticks[word]}
            testid={`confirm-${word}`}
            disabled={disabled}
          />
        ))}
    </>
  );
}

/** Save, if optional: never checked initially, and planned again when changed. */
export function SaveTick({ flow }: { flow: ChangeFlow }) {
  const { save: label, ram } = changing.kinds[flow.request.kind];
  const { save } = flow;
  if (flow.request.save !== "optional" || label === undefined || (flow.parts.value?.length ?? 0) === 0)
    return null;
  const put = (on: boolean) => {
    save.value = on;
  };
  return (
    <>
      <Tick
        at={cell(
          save.value,
          on =>
            void flow.choose(
              () => put(on),
              () => put(!on),
            ),
        )}
        label={label}
        testid="change-save"
        disabled={flow.phase.value !== "ready"}
      />
      {!save.value && ram !== undefined && <p class="small second">{ram}</p>}
    </>
  );
}

export function HornFreeTick({ of, big = false }: { of: HornFree; big?: boolean }) {
  if (of.count === 0) return null;
  return (
    <Tick
      at={cell(of.agreed, free => of.say(free))}
      label={saving.free(of.count)}
      testid="horn-free"
      {...(big ? { class: "tick big" } : {})}
    />
  );
}

/** Effect of the restart on each servo. */
export function AfterRestart({ flow }: { flow: ChangeFlow }) {
  const all = flow.able.value.filter(one => one.restart !== undefined);
  if (all.length === 0 || !flow.current.value) return null;
  return (
    <div class="after-save" data-testid="after-save">
      {flow.request.save !== "never" && <h3>{saving.afterSave(all.length)}</h3>}
      <ul>
        {all.map(one => (
          <li key={one.uid}>
            <b>{nameOf(servo(one.uid))}</b>: {one.restart ? hornLine(one.restart) : saving.unknownHead}
          </li>
        ))}
      </ul>
    </div>
  );
}
