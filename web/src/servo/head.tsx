/** The head of a servo's page: its horn, its name (opens the picker), its condition. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { stopped } from "../bench/bench";
import type { KnownServo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { modelName } from "../bench/model";
import { motionOn } from "../bench/moving";
import { conditionHere } from "../bench/servo-condition";
import { canRestore } from "../change/restorable";
import { RestoreButton } from "../change/restore-button";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { text } from "../text";
import { ServoActions } from "./actions";
import { ConditionLines } from "./condition-lines";
import { LiveDial } from "./live-dial";
import { FirmwareNote, ModelNotes, useNote } from "./model-notes";
import { ServoPicker } from "./picker";
import { RomState } from "./rom-state";

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
        <LiveDial one={one} size={64} />
        <div class="who">
          <ServoPicker one={one} />
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
        <RomState one={one} />
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
          <ServoActions key={one.uid} one={one} />
          {children}
        </div>
      </header>
      {refused.value !== null && (
        <div class="notice-line">
          <Note testid="restore-refused">{refused.value}</Note>
        </div>
      )}
      <ModelNotes one={one} open={noted.value} />
    </>
  );
}
