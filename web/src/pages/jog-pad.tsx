/** Owns the jog pad: dial, readouts, six steps, a typed value, Go to 0°, torque; arrows while it has the focus. */
import { useSignal } from "@preact/signals";
import type { TorqueMode } from "../api/types";
import { angle, number, signed, withUnit } from "../form/format";
import { check, type Span } from "../form/number";
import { now } from "../state/clock";
import { angleOf, type KnownServo, servo } from "../state/fleet";
import { limitsOf } from "../state/here";
import { up } from "../state/link";
import { dragTo, moveTo, pace, question, refusal, setpoint, setTorque, warnings } from "../state/motion";
import { touch } from "../state/screen";
import { telemetry } from "../telemetry/store";
import { text } from "../text/en";
import { Button } from "../ui/button";
import { Dialog } from "../ui/dialog";
import { Glyph } from "../ui/glyph";
import { Segments } from "../ui/segments";
import { UnitMark } from "../ui/unit-mark";
import { JogDial } from "./jog-dial";
import { ANGLE_STALE_S } from "./servo-row";

const STEPS = [-10, -1, -0.1, 0.1, 1, 10];
/** Closer than this is there: one step of the register and the sensor's noise. */
const THERE_DEG = 0.3;

export function JogPad({ uid, torque }: { uid: string; torque: TorqueMode }) {
  const typed = useSignal<string | null>(null);
  const complaint = useSignal<string | null>(null);
  const unlocked = useSignal(false);
  const one = servo(uid);
  const limits = limitsOf(uid);
  if (!one) return null;
  const present = angleOf(one, now.value);
  const stale = !up.value || !one.online || present.age === null || present.age > ANGLE_STALE_S;
  const on = torque === "on";
  const able = on && up.value && limits !== null;
  const span: Span = { unit: "°", perUnit: 10, minimum: limits?.ccw ?? null, maximum: limits?.cw ?? null };

  const command = (value: number) => {
    typed.value = null;
    complaint.value = null;
    void moveTo(value);
  };
  const jog = (step: number) => {
    if (!able || !limits) return;
    const from = setpoint.peek() ?? present.value;
    if (from === null) return;
    const wanted = Math.round((from + step) * 10) / 10;
    const inside = Math.min(limits.cw, Math.max(limits.ccw, wanted));
    if (inside === from) complaint.value = refused(wanted, span);
    else command(inside);
  };
  const enter = () => {
    const verdict = check(typed.peek() ?? "", span);
    if (verdict.ok) command(verdict.value);
    else complaint.value = `${verdict.what} ${verdict.remedy} ${text.motion.notSent}`;
  };
  const arrows = (event: KeyboardEvent) => {
    const way = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (way === 0 || (event.target as HTMLElement).tagName === "INPUT") return;
    event.preventDefault();
    jog(way * (event.shiftKey ? 10 : event.altKey ? 0.1 : 1));
  };

  return (
    <section
      class="jog"
      role="group"
      // biome-ignore lint/a11y/noNoninteractiveTabindex: the pad takes the focus so that arrow keys jog
      tabIndex={0}
      aria-label={text.motion.jog}
      data-testid="jog-pad"
      onKeyDown={arrows}
    >
      <JogDial
        angle={present.value}
        command={on ? setpoint.value : null}
        limits={limits}
        stale={stale}
        locked={touch.value && !unlocked.value}
        onDrag={able ? dragTo : undefined}
      />
      <Figures one={one} angle={present.value} stale={stale} on={on} />
      {(refusal.value ?? complaint.value) !== null && (
        <p class="refusal" role="alert" data-testid="jog-refusal">
          <Glyph kind="failure" size={14} /> {refusal.value ?? complaint.value}
        </p>
      )}
      {warnings.value.map(said => (
        <p key={said} class="refusal mild" role="status" data-testid="jog-warning">
          <Glyph kind="warning" size={14} /> {said}
        </p>
      ))}
      <Agree />
      {!on && <p class="second">{text.motion.torqueIsOff}</p>}
      {limits === null && <p class="second">{text.motion.limitsUnknown}</p>}
      <Pace />
      <fieldset class="steps" aria-label={text.motion.steps}>
        {STEPS.map(step => (
          <Button key={step} testid={`jog-step-${step}`} live disabled={!able} onClick={() => jog(step)}>
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
        <Button testid="jog-zero" live disabled={!able} onClick={() => command(0)}>
          {text.motion.zero}
        </Button>
        {on ? (
          <Button look="danger" testid="jog-torque-off" onClick={() => void setTorque("off")}>
            {text.motion.torqueOff}
          </Button>
        ) : (
          <Button testid="jog-torque-on" live onClick={() => void setTorque("on")}>
            {text.motion.torqueOn}
          </Button>
        )}
      </div>
      <p class="hint small second">
        {!touch.value && (
          <>
            <kbd>←</kbd> <kbd>→</kbd> {text.motion.keyHint[0]} <kbd>Shift</kbd> {text.motion.keyHint[1]}{" "}
            <kbd>Alt</kbd> {text.motion.keyHint[2]}
          </>
        )}
        <span class="grow" />
        {limits && text.motion.limits(angle(limits.ccw), angle(limits.cw))}
      </p>
      {touch.value && (
        <Button
          testid="unlock-drag"
          pressed={unlocked.value}
          onClick={() => {
            unlocked.value = !unlocked.value;
          }}
        >
          {unlocked.value ? text.motion.unlocked : text.motion.locked}
        </Button>
      )}
    </section>
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

/** What will happen, asked before a move that somebody has to agree to. */
function Agree() {
  const asked = question.value;
  if (asked === null) return null;
  const close = () => {
    question.value = null;
  };
  return (
    <Dialog
      title={text.motion.question}
      testid="move-dialog"
      onClose={close}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={close}>{text.motion.questionNot}</Button>
          </span>
          <Button
            look="danger"
            testid="move-anyway"
            live
            onClick={() => void moveTo(asked.angle, asked.words)}
          >
            {text.motion.questionDo}
          </Button>
        </>
      }
    >
      {asked.said.map(said => (
        <p key={said} class="refusal mild">
          <Glyph kind="warning" size={14} /> {said}
        </p>
      ))}
    </Dialog>
  );
}

function refused(value: number, span: Span): string {
  const verdict = check(number(value, 1), span);
  return verdict.ok ? "" : `${verdict.what} ${text.motion.notSent}`;
}

function Figures({
  one,
  angle: present,
  stale,
  on,
}: {
  one: KnownServo;
  angle: number | null;
  stale: boolean;
  on: boolean;
}) {
  const wanted = setpoint.value;
  const gap = wanted !== null && present !== null ? Math.abs(wanted - present) : null;
  const speed = telemetry.latest(one.uid, "current_speed", now.value);
  const torque = telemetry.latest(one.uid, "current_torque", now.value);
  return (
    <div class="figures">
      <span>
        <small class="second">{text.motion.angle}</small>
        <b class={stale ? "dim" : ""} data-testid="jog-angle">
          {angle(present)}
        </b>
        <UnitMark one={one} />
      </span>
      <span class="between small second">
        {on &&
          gap !== null &&
          (gap > THERE_DEG ? text.motion.toGo(withUnit(number(gap, 1), "°")) : text.motion.there)}
        <br />
        {speed &&
          torque &&
          text.motion.drive(withUnit(number(speed.value, 0), "rpm"), withUnit(number(torque.value, 0), "%"))}
      </span>
      <span class="right">
        <small class="k-intent">{text.motion.command}</small>
        <b class="k-intent" data-testid="jog-command">
          {on ? angle(wanted) : angle(null)}
        </b>
      </span>
    </div>
  );
}
