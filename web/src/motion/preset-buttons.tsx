/** A, Go to 0°, B: a press moves there; the pencil button or a long press stores the present angle. */
import { useRef } from "preact/hooks";
import { nameOf, peekServo } from "../bench/fleet";
import { angle } from "../bench/format";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { Icon } from "../kit/icon";
import { type Preset, presetOf, replacing, requestPreset, storePreset } from "./presets";
import { jogging as words } from "./words";

const LONG_MS = 600;

interface Props {
  uid: string;
  able: boolean;
  /** Present angle; null while it is stale and must not be stored. */
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
    if (present !== null) requestPreset(uid, preset, present);
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
          // The release after a long press is not a click.
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

/** Confirmation before a stored angle is replaced. Nothing moves. */
export function ReplacePreset() {
  const request = replacing.value;
  if (request === null) return null;
  const name = words.presetName[request.preset];
  return (
    <Confirm
      title={words.replace(name, nameOf(peekServo(request.uid)))}
      verb={words.replaceVerb}
      local
      testid="preset-dialog"
      actId="preset-replace"
      act={() => storePreset(request.uid, request.preset, request.by)}
      onClose={() => {
        replacing.value = null;
      }}
    >
      <p>{words.replaceText(angle(request.from), angle(request.by))}</p>
    </Confirm>
  );
}
