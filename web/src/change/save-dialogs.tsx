/** The two dialogs before a write: the diff, and the question before a save, what moves first. */
import type { Forecast, SavePreview } from "../api/config-types";
import { type KnownServo, nameOf } from "../bench/fleet";
import { NONE } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { text } from "../text";
import { BeforeAfter } from "./before-after";
import { ChangeList } from "./change-list";
import { HornForecast } from "./horn-forecast";
import { HornFreeTick, useHornFree } from "./horn-free";

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
  one: KnownServo;
  plan: SavePreview;
  onClose: () => void;
  onConfirm: () => void;
}

/** What ROM will hold differently, as the server planned it, and before that what the horn does. */
export function SaveDialog({ one, plan, onClose, onConfirm }: SaveProps) {
  const changes = plan.rom_changes ?? [];
  const unknown = plan.rom_unknown ?? [];
  const forecast = plan.restart ?? null;
  const free = useHornFree([{ uid: one.uid, moves: forecast?.moves !== false }]);
  const name = nameOf(one);
  const identity = changes.some(each => each.key === "servo_id" || each.key === "node_id");
  const off = one.output.state === "off" || one.output.state === "brake";
  const comesOn = off && forecast !== null && !STARTS_OFF.has(forecast.code);
  return (
    <Dialog
      title={text.save.title(changes.length, name)}
      subtitle={text.save.facts(one.model ?? NONE, one.serial ?? NONE, String(one.servo_id ?? NONE))}
      testid="save-dialog"
      onClose={onClose}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={onClose}>{text.cancel}</Button>
          </span>
          <Button look="primary" testid="confirm-save" live disabled={!free.agreed} onClick={onConfirm}>
            {text.save.confirm(name)}
          </Button>
        </>
      }
    >
      {forecast && (
        <HornForecast one={one} forecast={forecast} verb="save">
          {comesOn && <p>{text.save.outputOn}</p>}
          {identity && <p>{text.save.idChange}</p>}
        </HornForecast>
      )}
      {changes.length === 0 ? (
        <p>{text.save.nothing}</p>
      ) : (
        <BeforeAfter
          head={{ parameter: text.save.head.parameter, now: text.save.head.rom, next: text.save.head.after }}
          changes={changes.map(each => ({ key: each.key, now: each.before, next: each.after }))}
          testid="change"
        />
      )}
      {unknown.length > 0 && <p class="small second">{text.save.unknownRows(unknown.length)}</p>}
      <HornFreeTick of={free} />
    </Dialog>
  );
}

/** The servo starts without torque, so nothing has to come on before. */
const STARTS_OFF: ReadonlySet<Forecast["code"]> = new Set(["no_torque", "brake", "unknown"]);
