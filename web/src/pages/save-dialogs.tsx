/** Owns the two dialogs before a write: the diff, and the question before a save, what moves first. */
import { useSignal } from "@preact/signals";
import { ChangeList } from "../form/change-list";
import { angle, NONE } from "../form/format";
import { mayMove, type Prediction } from "../form/prediction";
import { now } from "../state/clock";
import { angleOf, type KnownServo, nameOf } from "../state/fleet";
import { limitsOf } from "../state/here";
import type { Sheet } from "../state/parameters";
import { text } from "../text";
import { Button } from "../ui/button";
import { Dial } from "../ui/dial";
import { Dialog } from "../ui/dialog";

interface DiffProps {
  sheet: Sheet;
  name: string;
  keys: readonly string[];
  onClose: () => void;
}

export function DiffDialog({ sheet, name, keys, onClose }: DiffProps) {
  return (
    <Dialog
      title={text.save.diffTitle(keys.length, name)}
      testid="diff-dialog"
      onClose={onClose}
      foot={
        <span data-first-focus>
          <Button onClick={onClose}>{text.close}</Button>
        </span>
      }
    >
      <ChangeList sheet={sheet} keys={keys} withRam />
    </Dialog>
  );
}

interface SaveProps {
  sheet: Sheet;
  one: KnownServo;
  keys: readonly string[];
  prediction: Prediction;
  onClose: () => void;
  onConfirm: () => void;
}

export function SaveDialog({ sheet, one, keys, prediction, onClose, onConfirm }: SaveProps) {
  const free = useSignal(false);
  const name = nameOf(one);
  const present = angleOf(one, now.value).value;
  const moves = mayMove(prediction);
  const manyTurns = present !== null && Math.abs(present) > 180;
  const identity = keys.includes("servo_id") || keys.includes("node_id");
  const torqueToo = keys.includes("torque_mode") && (prediction === "soft_start" || prediction === "hold");
  return (
    <Dialog
      title={text.save.title(keys.length, name)}
      subtitle={text.save.facts(one.model ?? NONE, one.serial ?? NONE, String(one.servo_id ?? NONE))}
      testid="save-dialog"
      onClose={onClose}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={onClose}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            testid="confirm-save"
            live
            disabled={moves && !free.value}
            onClick={onConfirm}
          >
            {text.save.confirm(name)}
          </Button>
        </>
      }
    >
      <div class="what-moves">
        <Dial
          size={140}
          angle={present}
          limits={limitsOf(one.uid)}
          {...(prediction === "soft_start" ? { goesTo: 0 } : {})}
        />
        <div>
          <h3>{heading(prediction, present)}</h3>
          <p class="second">{WHY[prediction]()}</p>
          {manyTurns && <p>{text.save.turnsLost(angle(present))}</p>}
          {torqueToo && <p>{text.save.torqueOn}</p>}
          {identity && <p>{text.save.idChange}</p>}
        </div>
      </div>
      <ChangeList sheet={sheet} keys={keys} />
      {moves && (
        <label class="tick">
          <input
            type="checkbox"
            data-testid="horn-free"
            checked={free.value}
            onChange={event => {
              free.value = event.currentTarget.checked;
            }}
          />
          {text.save.free}
        </label>
      )}
    </Dialog>
  );
}

const WHY: Record<Prediction, () => string> = {
  soft_start: () => text.save.movesWhy,
  hold: () => text.save.holdsWhy,
  off: () => text.save.offWhy,
  brake: () => text.save.brakeWhy,
  unknown: () => text.save.unknownWhy,
};

function heading(prediction: Prediction, present: number | null): string {
  switch (prediction) {
    case "soft_start":
      return present === null ? text.save.movesUnknown : text.save.moves(angle(present));
    case "hold":
      return text.save.holds;
    case "off":
      return text.save.offHead;
    case "brake":
      return text.save.brakeHead;
    case "unknown":
      return text.save.unknownHead;
  }
}
