/** A · Go to 0° · B: a press goes there; the pencil, or a long press, stores where the horn is now. */
import { useRef } from "preact/hooks";
import { nameOf, peekServo } from "../bench/fleet";
import { angle } from "../bench/format";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { Icon } from "../kit/icon";
import { type Preset, presetOf, replacing, storePreset, wishPreset } from "./presets";
import { jogging as words } from "./words";

const LONG_MS = 600;

interface Props {
  uid: string;
  able: boolean;
  /** Where the horn is; null while that is not known well enough to be stored. */
  present: number | null;
  onGo: (angle: number) => void;
}

export function PresetButtons({ uid, able, present, onGo }: Props) {
  const preset = (key: Preset) => (
    <PresetButton key={`${uid}${key}`} uid={uid} preset={key} able={able} present={present} onGo={onGo} />
  );
  return (
    <fieldset class="presets" aria-label={words.presets}>
      {preset("a")}
      <Button testid="jog-zero" live disabled={!able} onClick={() => onGo(0)}>
        {words.zero}
      </Button>
      {preset("b")}
    </fieldset>
  );
}

function PresetButton({ uid, preset, able, present, onGo }: Props & { preset: Preset }) {
  const stored = presetOf(uid, preset);
  const name = words.presetName[preset];
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const long = useRef(false);
  const store = () => {
    if (present !== null) wishPreset(uid, preset, present);
  };
  const up = () => clearTimeout(timer.current);
  if (stored === null) {
    return (
      <Button
        testid={`preset-${preset}`}
        disabled={present === null}
        label={words.storeAs(name)}
        onClick={store}
      >
        <b>{name}</b> {words.set}
      </Button>
    );
  }
  return (
    <div
      class="preset"
      role="group"
      aria-label={name}
      onPointerDown={event => {
        long.current = false;
        clearTimeout(timer.current);
        if (event.pointerType === "mouse") return;
        timer.current = setTimeout(() => {
          long.current = true;
          store();
        }, LONG_MS);
      }}
      onPointerUp={up}
      onPointerCancel={up}
      onPointerLeave={up}
      onContextMenu={event => event.preventDefault()}
    >
      <Button
        testid={`preset-${preset}`}
        live
        disabled={!able}
        title={words.longPress}
        label={words.goThere(name, angle(stored))}
        onClick={() => {
          // The end of a long press is no press.
          if (!long.current) onGo(stored);
          long.current = false;
        }}
      >
        <b>{name}</b> {angle(stored)}
      </Button>
      <Button
        testid={`preset-${preset}-store`}
        label={words.storeAs(name)}
        title={words.storeAs(name)}
        disabled={present === null}
        onClick={store}
      >
        <Icon name="pencil" size={14} />
      </Button>
    </div>
  );
}

/** Asked before a stored angle is lost. Nothing moves by it. */
export function ReplacePreset() {
  const wish = replacing.value;
  if (wish === null) return null;
  const name = words.presetName[wish.preset];
  return (
    <Confirm
      title={words.replace(name, nameOf(peekServo(wish.uid)))}
      verb={words.replaceVerb}
      local
      testid="preset-dialog"
      actId="preset-replace"
      act={() => storePreset(wish.uid, wish.preset, wish.by)}
      onClose={() => {
        replacing.value = null;
      }}
    >
      <p>{words.replaceText(angle(wish.from), angle(wish.by))}</p>
    </Confirm>
  );
}
