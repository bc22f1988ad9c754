/** Owns the jog pad: what is commanded (angle, speed, torque, sweep), the dial, the readouts, and torque. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { TorqueMode } from "../api/types";
import { angle, number, signed, withUnit } from "../form/format";
import { check, type Span } from "../form/number";
import { now } from "../state/clock";
import { angleOf, type KnownServo, servo } from "../state/fleet";
import { limitsOfAll, stream } from "../state/group";
import { limitsOf } from "../state/here";
import { held, letGo } from "../state/holding";
import { up } from "../state/link";
import {
  dragTo,
  membersOf,
  motion,
  moveTo,
  question,
  refusal,
  setpoint,
  setTorque,
  together,
  warnings,
} from "../state/motion";
import { touch } from "../state/screen";
import { sweep } from "../state/sweep";
import { telemetry } from "../telemetry/store";
import { text } from "../text";
import { jogging as words } from "../text/topics";
import { Button } from "../ui/button";
import { Dialog } from "../ui/dialog";
import { Glyph } from "../ui/glyph";
import { Segments } from "../ui/segments";
import { UnitMark } from "../ui/unit-mark";
import { JogAngle } from "./jog-angle";
import { JogDial } from "./jog-dial";
import { JogHold } from "./jog-hold";
import { JogSweep } from "./jog-sweep";
import { Members } from "./motion-group";
import { ANGLE_STALE_S } from "./servo-row";
import "../style/jog.css";

/** Closer than this is there: one step of the register and the sensor's noise. */
const THERE_DEG = 0.3;

type Tab = "angle" | "speed" | "torque" | "sweep";
const TABS: readonly Tab[] = ["angle", "speed", "torque", "sweep"];

export function JogPad({ uid, torque }: { uid: string; torque: TorqueMode }) {
  const tab = useSignal<Tab>("angle");
  const complaint = useSignal<string | null>(null);
  const unlocked = useSignal(false);
  const pad = useRef<HTMLElement>(null);
  const one = servo(uid);
  const members = membersOf(motion.value);
  const limits = together.value === null ? limitsOf(uid) : limitsOfAll(members);
  const ready = limits !== null;
  // The button that turned motion on is gone: the keys go on where the hands are.
  useEffect(() => {
    if (ready) pad.current?.querySelector<SVGElement>("[role=slider]")?.focus({ preventScroll: true });
  }, [ready]);
  if (!one) return null;
  const present = angleOf(one, now.value);
  const stale = !up.value || !one.online || present.age === null || present.age > ANGLE_STALE_S;
  const on = torque === "on";
  const sweeping = sweep.value !== null;
  const shown = sweeping ? "sweep" : tab.value;
  const parted = together.value !== null && stream.value?.ended != null;
  const able = on && up.value && limits !== null && !sweeping && !parted;
  const jogs = able && shown === "angle";
  const span: Span = { unit: "°", perUnit: 10, minimum: limits?.ccw ?? null, maximum: limits?.cw ?? null };

  const command = (value: number) => {
    complaint.value = null;
    void moveTo(value);
  };
  const jog = (step: number) => {
    if (!jogs || !limits) return;
    const from = setpoint.peek() ?? present.value;
    if (from === null) return;
    const wanted = Math.round((from + step) * 10) / 10;
    const inside = Math.min(limits.cw, Math.max(limits.ccw, wanted));
    if (inside === from) complaint.value = refused(wanted, span);
    else command(inside);
  };
  const keys = (event: KeyboardEvent) => {
    if (!jogs || (event.target as HTMLElement).tagName === "INPUT" || event.ctrlKey || event.metaKey) return;
    const way = WAYS[event.key] ?? 0;
    if (event.key === "0" && !event.altKey && !event.repeat) command(0);
    else if (way !== 0)
      jog(way * (event.shiftKey || event.key.startsWith("Page") ? 10 : event.altKey ? 0.1 : 1));
    else return;
    event.preventDefault();
  };

  return (
    <div class="jog-wrap" data-group={members.length > 1}>
      <section
        ref={pad}
        class="jog"
        data-tab={shown}
        role="group"
        aria-label={text.motion.jog}
        data-testid="jog-pad"
        onKeyDown={keys}
      >
        <Segments<Tab>
          label={words.tabs}
          chosen={shown}
          onChoose={next => {
            if (sweep.peek() !== null) return;
            letGo();
            complaint.value = null;
            refusal.value = null;
            warnings.value = [];
            tab.value = next;
          }}
          options={TABS.map(key => ({ key, label: words.tab[key] }))}
        />
        <JogDial
          angle={present.value}
          command={on ? setpoint.value : null}
          limits={limits}
          stale={stale}
          locked={touch.value && !unlocked.value}
          onDrag={jogs ? dragTo : undefined}
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
        {limits === null && (
          <p class="second">{members.length > 1 ? words.noSpan : text.motion.limitsUnknown}</p>
        )}
        <div class="jog-panel">
          {shown === "angle" && (
            <JogAngle span={span} able={jogs} onJog={jog} onCommand={command} complaint={complaint}>
              <Torque on={on} />
            </JogAngle>
          )}
          {(shown === "speed" || shown === "torque") && (
            <JogHold key={shown} uid={uid} kind={shown} able={on && up.value} />
          )}
          {shown === "sweep" && <JogSweep limits={limits} able={on && !parted} />}
          <div class="jog-foot small second">
            {shown === "angle" && touch.value && (
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
            {shown === "angle" && !touch.value && <KeyHint />}
            <span class="grow" />
            {shown === "angle" && limits && (
              <span class="whole">{text.motion.limits(angle(limits.ccw), angle(limits.cw))}</span>
            )}
            {shown !== "angle" && <Torque on={on} />}
          </div>
        </div>
      </section>
      <Members />
    </div>
  );
}

function Torque({ on }: { on: boolean }) {
  return on ? (
    <Button look="danger" testid="jog-torque-off" onClick={() => void setTorque("off")}>
      {text.motion.torqueOff}
    </Button>
  ) : (
    <Button testid="jog-torque-on" live onClick={() => void setTorque("on")}>
      {text.motion.torqueOn}
    </Button>
  );
}

function KeyHint() {
  return (
    <>
      <kbd>←</kbd> <kbd>→</kbd> {text.motion.keyHint[0]} <kbd>Shift</kbd> {text.motion.keyHint[1]}{" "}
      <kbd>Alt</kbd> {text.motion.keyHint[2]} <kbd>0</kbd> 0°
    </>
  );
}

const WAYS: Readonly<Record<string, number>> = { ArrowRight: 1, ArrowLeft: -1, PageUp: 1, PageDown: -1 };

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
  const going = held.value;
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
          {going !== null
            ? withUnit(signed(going.value, 0), going.kind === "speed" ? "rpm" : "%")
            : angle(on ? wanted : null)}
        </b>
      </span>
    </div>
  );
}
