/** The angle tab of the jog pad: presets, speed and steps; on a phone two buttons that step or move, else a typed value. */
import { signal, useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { signed, withUnit } from "../bench/format";
import { brake, pressByPointer, walk, walking } from "../bench/hold-to-run";
import { pace, setpoint } from "../bench/motion";
import { type AllowedSpan, check, type NotAllowed, parseNumber } from "../bench/number";
import { phone, touch } from "../bench/screen";
import { Button } from "../kit/button";
import { Icon } from "../kit/icon";
import { Segments } from "../kit/segments";
import { PresetButtons } from "./preset-buttons";
import { jogging as words } from "./words";

interface Props {
  uid: string;
  span: AllowedSpan;
  able: boolean;
  /** Present angle; null while it is stale and must not be stored. */
  present: number | null;
  onJog: (step: number) => void;
  onCommand: (angle: number) => void;
  /** Called with the reason why a typed value is not sent, and its number if any; with null while typing. */
  onWrong: (verdict: NotAllowed | null, value: number | null) => void;
}

export function JogAngle({ uid, span, able, present, onJog, onCommand, onWrong }: Props) {
  const typed = useSignal<string | null>(null);
  const go = (value: number) => {
    typed.value = null;
    const verdict = check(signed(value, 1), span);
    if (verdict.ok) onCommand(verdict.value);
    else onWrong(verdict, value);
  };
  const presets = <PresetButtons uid={uid} able={able} present={present} onGo={go} />;
  if (phone.value) {
    return (
      <>
        {presets}
        <div class="jog-how">
          <Segments<string>
            label={words.steps}
            chosen={String(stepChosen.value)}
            onChoose={key => {
              stepChosen.value = Number(key);
            }}
            options={STEP_SIZES.map(one => ({ key: String(one), label: stepText(one) }))}
          />
          <Pace direct={false} />
        </div>
        <div class="hold-buttons">
          <Walk direction={-1} span={span} able={able} onJog={onJog} />
          <Walk direction={1} span={span} able={able} onJog={onJog} />
        </div>
      </>
    );
  }
  return (
    <>
      <Pace direct />
      <fieldset class="steps" aria-label={words.steps}>
        {STEPS.map(step => (
          <Button key={step} testid={`jog-step-${step}`} live disabled={!able} onClick={() => onJog(step)}>
            {withUnit(signed(step, Math.abs(step) < 1 ? 1 : 0), "°")}
          </Button>
        ))}
      </fieldset>
      <Enter typed={typed} span={span} able={able} onCommand={onCommand} onWrong={onWrong} />
      {presets}
    </>
  );
}

const STEP_SIZES = [0.1, 1, 10];
const STEPS = [...STEP_SIZES.map(one => -one).reverse(), ...STEP_SIZES];
const stepChosen = signal(1);

function stepText(step: number): string {
  return withUnit(String(step), "°");
}

/** Longest press that counts as a tap. */
const TAP_MS = 300;

/** A tap moves by one step, holding moves until released. */
function Walk({
  direction,
  span,
  able,
  onJog,
}: { direction: 1 | -1 } & Pick<Props, "span" | "able" | "onJog">) {
  const walked = useRef(false);
  const limit = direction > 0 ? span.maximum : span.minimum;
  const on = walking.value === direction;
  return (
    <button
      type="button"
      class="button hold-button"
      data-testid={direction > 0 ? "walk-cw" : "walk-ccw"}
      data-held={on}
      aria-pressed={on}
      disabled={!able}
      onPointerDown={event => {
        walked.current = false;
        pressByPointer(event, still => {
          setTimeout(() => {
            if (!still() || limit === null) return;
            walked.current = true;
            walk(limit, still);
          }, TAP_MS);
        });
      }}
      onClick={() => {
        if (!walked.current) onJog(direction * stepChosen.peek());
        walked.current = false;
      }}
      onLostPointerCapture={brake}
      onBlur={brake}
      onContextMenu={event => event.preventDefault()}
    >
      <Icon name={direction > 0 ? "right" : "left"} size={28} />
      <b>{direction > 0 ? words.cw : words.ccw}</b>
      <small>
        {words.tapOrHold(withUnit(signed(direction * stepChosen.value, stepChosen.value < 1 ? 1 : 0), "°"))}
      </small>
    </button>
  );
}

function Enter({
  typed,
  span,
  able,
  onCommand,
  onWrong,
}: { typed: { value: string | null } } & Pick<Props, "span" | "able" | "onCommand" | "onWrong">) {
  const box = useRef<HTMLInputElement>(null);
  const go = useRef<HTMLButtonElement>(null);
  const shown = typed.value ?? (setpoint.value === null ? "" : signed(setpoint.value, 1));
  const entered = () => {
    const wanted = box.current?.value ?? "";
    const verdict = check(wanted, span);
    if (!verdict.ok) onWrong(verdict, parseNumber(wanted, span.unit));
    return verdict.ok ? verdict.value : null;
  };
  const send = () => {
    const value = entered();
    if (value === null) return;
    // With a keyboard, the next angle may follow; on touch, focus would open the on-screen keyboard.
    if (!touch.peek() && document.activeElement === go.current) box.current?.focus();
    typed.value = null;
    onCommand(value);
  };
  return (
    <div class="enter">
      <label class="box wide">
        <span class="hidden-text">{words.angle}</span>
        <input
          ref={box}
          type="text"
          inputMode="decimal"
          autocomplete="off"
          data-testid="jog-value"
          disabled={!able}
          value={shown}
          onFocus={event => event.currentTarget.select()}
          onInput={event => {
            typed.value = event.currentTarget.value;
            onWrong(null, null);
          }}
          onKeyDown={event => {
            // Typing moves nothing: Enter moves the focus to the button.
            if (event.key !== "Enter") return;
            // Otherwise the same key press would click the button.
            event.preventDefault();
            if (entered() !== null) go.current?.focus();
          }}
        />
        <span class="unit">°</span>
      </label>
      <Button testid="jog-go" live refTo={go} disabled={!able} onClick={send}>
        {words.go}
      </Button>
    </div>
  );
}

const SPEEDS = [15, 60, 180];

/** Speed: limited, or on larger screens also full speed. */
function Pace({ direct }: { direct: boolean }) {
  return (
    <Segments<string>
      label={words.pace}
      chosen={String(pace.value)}
      onChoose={key => {
        pace.value = key === "null" ? null : Number(key);
      }}
      options={[
        ...SPEEDS.map(one => ({ key: String(one), label: words.speedOf(withUnit(String(one), "°")) })),
        ...(direct ? [{ key: "null", label: words.direct }] : []),
      ]}
    />
  );
}
