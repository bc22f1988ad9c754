/** Parts of only one kind of change: servos of a profile, kept values of a reset, outputs and their loads. */
import { useId } from "preact/hooks";
import { problemText } from "../bench/facts";
import { all, nameOf, servo } from "../bench/fleet";
import { number, withUnit } from "../bench/format";
import { outputLine } from "../bench/output";
import { valueText } from "../bench/row-text";
import { cell, Tick } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { whyRefused } from "./consequences";
import type { ChangeFlow } from "./flow";
import type { ProfileFacts, ResetFacts } from "./requests";
import { able, type OutputFacts, type Prospect, toProblem } from "./restoring";
import { changing as strings } from "./words";

export function ProfileServos({ flow }: { flow: ChangeFlow }) {
  const { chosen, goOn } = flow.request.facts as ProfileFacts;
  const busy = flow.phase.value !== "ready";
  const online = all.value.filter(each => each.online && each.model !== null);
  const choose = (uid: string, on: boolean) => {
    const next = new Set(chosen.peek());
    if (on) next.add(uid);
    else next.delete(uid);
    chosen.value = next;
    flow.forget();
  };
  if (online.length === 0) return <p>{strings.profile.none}</p>;
  return (
    <>
      <fieldset class="change-servos" disabled={busy}>
        <legend class="second">{strings.profile.who}</legend>
        {online.map(each => {
          const part = flow.parts.value?.find(one => one.uid === each.uid);
          const left = part?.leftOut?.length ?? 0;
          return (
            <label key={each.uid} class="tick" data-testid={`apply-${each.uid}`}>
              <input
                type="checkbox"
                checked={chosen.value.has(each.uid)}
                onChange={event => choose(each.uid, event.currentTarget.checked)}
              />
              <span class="grow">
                {nameOf(each)} <small class="second">{each.model}</small>
              </span>
              {part && !part.problem && (
                <span class="small second" data-testid={`outcome-${each.uid}`}>
                  {strings.profile.planned(part.changes.length)}
                  {left > 0 && `, ${strings.leftOut(left)}`}
                </span>
              )}
            </label>
          );
        })}
      </fieldset>
      {flow.parts.value?.map(
        part =>
          part.problem && (
            <Note key={part.uid}>
              {nameOf(servo(part.uid))}: {whyRefused(part.problem)}
            </Note>
          ),
      )}
      {chosen.value.size > 1 && (
        <Tick at={goOn} label={strings.profile.goOn} testid="profile-go-on" disabled={busy} />
      )}
    </>
  );
}

export function ResetOptions({ flow }: { flow: ChangeFlow }) {
  const { keep, kept: stored } = flow.request.facts as ResetFacts;
  const words = strings.reset;
  const of = stored.value;
  const put = (on: boolean) => {
    keep.value = on;
  };
  if (of === null) return null;
  return (
    <>
      <Tick
        at={cell(
          keep.value,
          on =>
            void flow.choose(
              () => put(on),
              () => put(!on),
            ),
        )}
        label={words.keep(
          valueText("servo_id", of.servo_id),
          of.node_id === 0 ? words.dynamicNode : words.node(valueText("node_id", of.node_id)),
          valueText("origin", of.origin),
        )}
        testid="reset-keep"
        disabled={flow.phase.value !== "ready"}
      />
      {!keep.value && <p class="second">{words.identityGoes}</p>}
    </>
  );
}

export function ResetName({ flow }: { flow: ChangeFlow }) {
  const { name, typed } = flow.request.facts as ResetFacts;
  const box = useId();
  return (
    <>
      <p class="small second">{strings.reset.snapshot}</p>
      <div class="type-name">
        <label for={box}>{strings.reset.type(name)}</label>
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
    </>
  );
}

/** True if this page has taken motion control to keep outputs on. */
export function outputKept(flow: ChangeFlow): boolean {
  if (flow.request.kind !== "output") return false;
  const plan = (flow.request.facts as OutputFacts).plan.value;
  return plan !== null && able(plan).some(one => one.needs_lease);
}

export function OutputQuestion({ flow }: { flow: ChangeFlow }) {
  const { plan: found, stopped } = flow.request.facts as OutputFacts;
  const plan = found.value;
  const words = strings.output;
  if (plan === null) return null;
  const loaded = able(plan).filter(one => one.under_load);
  const names = loaded.map(one => nameOf(servo(one.uid))).join(", ");
  return (
    <>
      <p>
        {plan.clears_stop && words.clears} {words.lead}
      </p>
      {loaded.length > 0 && (
        <p class="confirmation restore-load" role="alert" data-testid="restore-load">
          <Glyph kind="warning" size={18} />
          <span>{words.loaded(names, loaded.length)}</span>
        </p>
      )}
      <ul class="restore-list">
        {plan.servos.map(one => (
          <Output key={one.uid} one={one} />
        ))}
      </ul>
      {outputKept(flow) && <p class="second">{words.keeps}</p>}
      {stopped() && <Note testid="change-refused">{words.again}</Note>}
    </>
  );
}

function Output({ one }: { one: Prospect }) {
  const torque = one.torque_pct ?? 0;
  const words = strings.output;
  return (
    <li data-testid={`restore-${one.uid}`} data-load={one.under_load} data-able={!one.problem}>
      <b>{nameOf(servo(one.uid))}</b>
      <small class="second">{outputLine(one.output)}</small>
      {one.problem ? (
        <small class="strong k-failure">{words.stays(problemText(toProblem(one.problem)))}</small>
      ) : (
        one.under_load && (
          <small class="strong k-warning">
            {words.load}
            {torque !== 0 && `, ${words.torque(withUnit(number(Math.abs(torque), 0), "%"))}`}
          </small>
        )
      )}
    </li>
  );
}
