/** The head of a servo's page: its horn, its name (which chooses another), its condition. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { stopped } from "../bench/bench";
import { all, type KnownServo, nameOf } from "../bench/fleet";
import { NONE } from "../bench/format";
import { modelName } from "../bench/model";
import { motionOn } from "../bench/moving";
import { go, sameFor } from "../bench/route";
import { conditionHere } from "../bench/servo-condition";
import { RestoreButton, RestoreRefused } from "../change/restore-button";
import { canRestore } from "../change/restoring";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { text } from "../text";
import { ServoActions } from "./actions";
import { ConditionLines } from "./condition-lines";
import { LiveDial } from "./live-dial";
import { FirmwareNote, ModelNotes, useNote } from "./model-notes";

interface Props {
  one: KnownServo;
  children?: ComponentChildren;
}

export function ServoHead({ one, children }: Props) {
  const condition = conditionHere(one);
  const refused = useSignal<string | null>(null);
  const noted = useNote();
  return (
    <>
      <header class="servo-page-head">
        <LiveDial one={one} size={56} />
        <div class="who">
          <ServoChoice one={one} />
          <small class="second">
            {text.params.facts(
              modelName(one),
              one.serial ?? NONE,
              String(one.servo_id ?? NONE),
              String(one.node_id ?? NONE),
            )}
            <FirmwareNote
              one={one}
              open={noted.value}
              onToggle={() => {
                noted.value = !noted.value;
              }}
            />
          </small>
        </div>
        <div class="how" data-testid="servo-state" data-kind={condition.kind} data-state={one.state}>
          <Glyph kind={condition.kind} />
          <ConditionLines uid={one.uid} of={condition} />
        </div>
        <div class="head-right">
          {canRestore(one) && !motionOn() && !stopped.value && (
            <RestoreButton
              uids={[one.uid]}
              testid="restore-one"
              onRefused={why => {
                refused.value = why;
              }}
            />
          )}
          <ServoActions one={one} />
          {children}
        </div>
      </header>
      {refused.value !== null && (
        <div class="notice-line">
          <RestoreRefused why={refused.value} />
        </div>
      )}
      <ModelNotes one={one} open={noted.value} />
    </>
  );
}

function ServoChoice({ one }: { one: KnownServo }) {
  const others = all.value;
  if (others.length < 2) return <h1>{nameOf(one)}</h1>;
  return (
    <h1 class="choose">
      <label>
        <span class="hidden-text">{text.params.choose}</span>
        <select
          value={one.uid}
          data-testid="choose-servo"
          onChange={event => go(sameFor(event.currentTarget.value))}
        >
          {others.map(other => (
            <option key={other.uid} value={other.uid}>
              {nameOf(other)}
            </option>
          ))}
        </select>
        <span class="choose-face" aria-hidden="true">
          {nameOf(one)}
          <Icon name="down" size={16} />
        </span>
      </label>
    </h1>
  );
}
