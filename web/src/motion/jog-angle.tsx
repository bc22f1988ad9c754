/** The angle part of the jog pad: how fast, six steps, a typed value, Go to 0°. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useRef } from "preact/hooks";
import { signed, withUnit } from "../bench/format";
import { pace, setpoint } from "../bench/motion";
import { type AllowedSpan, check, type NotAllowed, parseNumber } from "../bench/number";
import { touch } from "../bench/screen";
import { Button } from "../kit/button";
import { Segments } from "../kit/segments";
import { text } from "../text";

const STEPS = [-10, -1, -0.1, 0.1, 1, 10];

interface Props {
  span: AllowedSpan;
  able: boolean;
  onJog: (step: number) => void;
  onCommand: (angle: number) => void;
  /** Told why what was typed is not sent, with the number if it is one; null when it is typed anew. */
  onWrong: (verdict: NotAllowed | null, value: number | null) => void;
  /** Stands at the end of the row: torque. */
  children: ComponentChildren;
}

export function JogAngle({ span, able, onJog, onCommand, onWrong, children }: Props) {
  const typed = useSignal<string | null>(null);
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
    // By keys the next angle follows; a finger would bring up the screen's keyboard.
    if (!touch.peek() && document.activeElement === go.current) box.current?.focus();
    typed.value = null;
    onCommand(value);
  };
  return (
    <>
      <Pace />
      <fieldset class="steps" aria-label={text.motion.steps}>
        {STEPS.map(step => (
          <Button key={step} testid={`jog-step-${step}`} live disabled={!able} onClick={() => onJog(step)}>
            {withUnit(signed(step, Math.abs(step) < 1 ? 1 : 0), "°")}
          </Button>
        ))}
      </fieldset>
      <div class="enter">
        <label class="box wide">
          <span class="hidden-text">{text.motion.value}</span>
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
              // Typing moves nothing: Enter leads to the button that does.
              if (event.key !== "Enter") return;
              // Else the rest of this press would be the button's.
              event.preventDefault();
              if (entered() !== null) go.current?.focus();
            }}
          />
          <span class="unit">°</span>
        </label>
        <Button testid="jog-go" live refTo={go} disabled={!able} onClick={send}>
          {text.motion.go}
        </Button>
        <Button
          testid="jog-zero"
          live
          disabled={!able}
          onClick={() => {
            typed.value = null;
            onCommand(0);
          }}
        >
          {text.motion.zero}
        </Button>
        {children}
      </div>
    </>
  );
}

const SPEEDS = [15, 60, 180];
let chosenSpeed = 60;

/** How it moves: at a limited speed, or as fast as the servo can. */
function Pace() {
  const speed = pace.value;
  return (
    <div class="pace">
      <Segments<"gentle" | "direct">
        label={text.motion.pace}
        chosen={speed === null ? "direct" : "gentle"}
        onChoose={key => {
          pace.value = key === "direct" ? null : chosenSpeed;
        }}
        options={[
          { key: "gentle", label: text.motion.gentle },
          { key: "direct", label: text.motion.direct },
        ]}
      />
      {speed === null ? (
        <span class="small second">{text.motion.directHint}</span>
      ) : (
        <Segments<string>
          label={text.motion.speed}
          chosen={String(speed)}
          onChoose={key => {
            chosenSpeed = Number(key);
            pace.value = chosenSpeed;
          }}
          options={SPEEDS.map(one => ({
            key: String(one),
            label: text.motion.speedOf(withUnit(String(one), "°")),
          }))}
        />
      )}
    </div>
  );
}
