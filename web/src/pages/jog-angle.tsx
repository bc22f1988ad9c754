/** Owns the angle part of the jog pad: how fast, six steps, a typed value, Go to 0°. */
import { type Signal, useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { signed, withUnit } from "../form/format";
import { check, type Span } from "../form/number";
import { pace, setpoint } from "../state/motion";
import { text } from "../text";
import { Button } from "../ui/button";
import { Segments } from "../ui/segments";

const STEPS = [-10, -1, -0.1, 0.1, 1, 10];

interface Props {
  span: Span;
  able: boolean;
  onJog: (step: number) => void;
  onCommand: (angle: number) => void;
  /** Why what was typed is not sent. */
  complaint: Signal<string | null>;
  /** Stands at the end of the row: torque. */
  children: ComponentChildren;
}

export function JogAngle({ span, able, onJog, onCommand, complaint, children }: Props) {
  const typed = useSignal<string | null>(null);
  const enter = () => {
    const verdict = check(typed.peek() ?? "", span);
    if (verdict.ok) {
      typed.value = null;
      onCommand(verdict.value);
    } else complaint.value = `${verdict.what} ${verdict.remedy} ${text.motion.notSent}`;
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
            type="text"
            inputMode="decimal"
            autocomplete="off"
            data-testid="jog-value"
            disabled={!able}
            value={typed.value ?? (setpoint.value === null ? "" : signed(setpoint.value, 1))}
            onFocus={event => event.currentTarget.select()}
            onInput={event => {
              typed.value = event.currentTarget.value;
              complaint.value = null;
            }}
            onKeyDown={event => {
              if (event.key === "Enter") enter();
            }}
          />
          <span class="unit">° {text.motion.enter}</span>
        </label>
        <Button testid="jog-go" live disabled={!able || typed.value === null} onClick={enter}>
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
