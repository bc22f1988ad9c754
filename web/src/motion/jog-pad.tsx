/** The jog pad: command type (angle, speed, torque, sweep), dial, readouts, and torque. */

import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { TorqueMode } from "../api/types";
import { driveText } from "../bench/activity";
import { catalog } from "../bench/catalog";
import { type KnownServo, servo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { angleNow, figureNow } from "../bench/fresh";
import { brake, held } from "../bench/hold-to-run";
import { up } from "../bench/link";
import {
  dragSpan,
  dragTo,
  membersOf,
  motion,
  motionRefusal,
  moveTo,
  movingTogether,
  question,
  setpoint,
  setTorque,
  warnings,
} from "../bench/motion";
import { type AllowedSpan, check, type NotAllowed } from "../bench/number";
import { pathOf } from "../bench/route";
import { touch } from "../bench/screen";
import type { Limits } from "../bench/servo-condition";
import { limitsOf } from "../bench/servo-condition";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { follow } from "../kit/follow";
import { Icon } from "../kit/icon";
import { Note } from "../kit/note";
import { Segments } from "../kit/segments";
import { JogDial } from "../servo/command-dial";
import { UnitMark } from "../servo/unit-mark";
import { text } from "../text";
import { limitsOfAll, stream } from "./group";
import { Members } from "./group-panel";
import { JogAngle } from "./jog-angle";
import { JogHold } from "./jog-hold";
import { JogSweep } from "./jog-sweep";
import { ReplacePreset } from "./preset-buttons";
import { sweep } from "./sweep";
import { jogging as words } from "./words";
import "./jog.css";

/** Distance that counts as reached: one step of the register plus sensor noise. */
const THERE_DEG = 0.3;

type Tab = "angle" | "speed" | "torque" | "sweep";
const TABS: readonly Tab[] = ["angle", "speed", "torque", "sweep"];

export function JogPad({ uid, torque }: { uid: string; torque: TorqueMode }) {
  const tab = useSignal<Tab>("angle");
  const complaint = useSignal<Complaint | null>(null);
  const unlocked = useSignal(false);
  const pad = useRef<HTMLElement>(null);
  const one = servo(uid);
  const members = membersOf(motion.value);
  const limits = movingTogether.value === null ? limitsOf(uid) : limitsOfAll(members);
  const ready = limits !== null;
  // The button that turned motion on is gone: move the focus to the dial.
  useEffect(() => {
    if (ready) pad.current?.querySelector<SVGElement>("[role=slider]")?.focus({ preventScroll: true });
  }, [ready]);
  const on = torque === "on";
  const sweeping = sweep.value !== null;
  const shown = sweeping ? "sweep" : tab.value;
  const parted = movingTogether.value !== null && stream.value?.ended != null;
  const able = on && up.value && limits !== null && !sweeping && !parted;
  const jogs = able && shown === "angle";
  const locked = touch.value && !unlocked.value;
  // The horn in the 3D view can be dragged exactly when the dial can.
  useEffect(() => {
    dragSpan.value = jogs && !locked && limits ? { uid, limits } : null;
    return () => {
      dragSpan.value = null;
    };
  }, [uid, jogs, locked, limits?.ccw, limits?.cw]);
  if (!one) return null;
  const present = angleNow(one);
  const { stale } = present;
  const span: AllowedSpan = {
    unit: "°",
    perUnit: 10,
    minimum: limits?.ccw ?? null,
    maximum: limits?.cw ?? null,
  };

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
    if (inside === from) {
      const verdict = check(number(wanted, 1), span);
      if (!verdict.ok) complaint.value = complaintOf(verdict, wanted, limits, members.length > 1);
    } else command(inside);
  };
  const keys = (event: KeyboardEvent) => {
    if (!jogs || (event.target as HTMLElement).tagName === "INPUT" || event.ctrlKey || event.metaKey) return;
    const direction = DIRECTIONS[event.key] ?? 0;
    if (event.key === "0" && !event.altKey && !event.repeat) command(0);
    else if (direction !== 0)
      jog(direction * (event.shiftKey || event.key.startsWith("Page") ? 10 : event.altKey ? 0.1 : 1));
    else return;
    event.preventDefault();
  };

  return (
    <>
      <div class="jog-wrap">
        <section
          ref={pad}
          class="jog"
          data-tab={shown}
          role="group"
          aria-label={words.jog}
          data-testid="jog-pad"
          onKeyDown={keys}
        >
          <div class="jog-face">
            <JogDial
              angle={present.value}
              command={on ? setpoint.value : null}
              limits={limits}
              stale={stale}
              locked={locked}
              onDrag={jogs ? dragTo : undefined}
            />
            {shown === "angle" && touch.value && (
              <Button
                testid="unlock-drag"
                pressed={unlocked.value}
                onClick={() => {
                  unlocked.value = !unlocked.value;
                }}
              >
                <Icon name="lock" /> {unlocked.value ? words.unlocked : words.locked}
              </Button>
            )}
            <CommandStatus
              uid={uid}
              on={on}
              complaint={complaint.value}
              limits={limits}
              angles={shown === "angle"}
            />
            <Figures one={one} angle={present.value} stale={stale} on={on} />
          </div>
          <div class="jog-side">
            <Segments<Tab>
              label={words.tabs}
              chosen={shown}
              onChoose={next => {
                if (sweep.peek() !== null) return;
                brake();
                complaint.value = null;
                motionRefusal.value = null;
                warnings.value = [];
                tab.value = next;
              }}
              options={TABS.map(key => ({ key, label: words.tab[key] }))}
            />
            <div class="jog-panel">
              {shown === "angle" && (
                <JogAngle
                  uid={uid}
                  span={span}
                  able={jogs}
                  present={stale ? null : present.value}
                  onJog={jog}
                  onCommand={command}
                  onWrong={(verdict, value) => {
                    complaint.value = verdict && complaintOf(verdict, value, limits, members.length > 1);
                  }}
                />
              )}
              {(shown === "speed" || shown === "torque") && (
                <JogHold key={shown} uid={uid} kind={shown} able={on && up.value} />
              )}
              {shown === "sweep" && <JogSweep limits={limits} able={on && !parted} />}
            </div>
            <Torque on={on} />
          </div>
        </section>
        <Members />
      </div>
      <MoveDialog />
      <ReplacePreset />
    </>
  );
}

/** Why a command was not sent. */
interface Complaint {
  text: string;
  /** The row to change, if a limit of this servo is the reason. */
  row: "angle_limit_cw" | "angle_limit_ccw" | null;
}

function complaintOf(
  verdict: NotAllowed,
  value: number | null,
  limits: Limits | null,
  many: boolean,
): Complaint {
  const past = verdict.code === "above" || verdict.code === "below";
  if (!past || value === null || limits === null || many) {
    return { text: `${verdict.what} ${verdict.remedy} ${words.notSent}`, row: null };
  }
  const above = verdict.code === "above";
  const row = above ? "angle_limit_cw" : "angle_limit_ccw";
  const name = catalog.peek()?.rows.get(row)?.name ?? "";
  const limit = angle(above ? limits.cw : limits.ccw);
  return { text: `${text.motion.pastLimit[row](angle(value), limit, name)} ${words.notSent}`, row };
}

/**
 * Messages about the last command, else a hint. Its space is reserved, so that nothing moves under the pointer; longer
 * messages cover the foot of the dial.
 */
function CommandStatus({
  uid,
  on,
  complaint,
  limits,
  angles,
}: {
  uid: string;
  on: boolean;
  complaint: Complaint | null;
  limits: Limits | null;
  angles: boolean;
}) {
  const wrong = motionRefusal.value ?? complaint?.text ?? null;
  const row = motionRefusal.value === null ? (complaint?.row ?? null) : null;
  const path = row && pathOf("parameters", uid, row);
  const quiet = wrong === null && warnings.value.length === 0;
  return (
    <div class="jog-note">
      <div>
        {wrong !== null && (
          <Note testid="jog-refusal">
            {wrong}{" "}
            {path && (
              <a href={path} data-testid="change-limit" onClick={event => follow(event, path)}>
                {words.changeLimit}
              </a>
            )}
          </Note>
        )}
        {warnings.value.map(said => (
          <Note key={said} kind="warning" testid="jog-warning">
            {said}
          </Note>
        ))}
        {quiet && !on && <p class="second">{words.torqueIsOff}</p>}
        {quiet && limits === null && (
          <p class="second">{movingTogether.value === null ? words.limitsUnknown : words.noSpan}</p>
        )}
        {quiet && on && limits !== null && angles && (
          <p class="jog-hint small second">
            {!touch.value && <KeyHint />}
            <span class="grow" />
            <span class="whole">{words.limits(angle(limits.ccw), angle(limits.cw))}</span>
          </p>
        )}
      </div>
    </div>
  );
}

/** At the same place for every command type. */
function Torque({ on }: { on: boolean }) {
  return (
    <div class="jog-torque">
      {on ? (
        <Button look="danger" testid="jog-torque-off" onClick={() => void setTorque("off")}>
          {words.torqueOff}
        </Button>
      ) : (
        <Button testid="jog-torque-on" live onClick={() => void setTorque("on")}>
          {words.torqueOn}
        </Button>
      )}
    </div>
  );
}

function KeyHint() {
  return (
    <>
      <kbd>←</kbd> <kbd>→</kbd> {words.keyHint[0]} <kbd>Shift</kbd> {words.keyHint[1]} <kbd>Alt</kbd>{" "}
      {words.keyHint[2]} <kbd>0</kbd> 0°
    </>
  );
}

const DIRECTIONS: Readonly<Record<string, number>> = {
  ArrowRight: 1,
  ArrowLeft: -1,
  PageUp: 1,
  PageDown: -1,
};

/** Confirmation of a move that needs one: what will happen. */
function MoveDialog() {
  const pending = question.value;
  if (pending === null) return null;
  return (
    <Confirm
      title={words.question}
      verb={words.questionDo}
      danger
      testid="move-dialog"
      actId="move-anyway"
      // Moving closes this dialog and may open another one.
      act={() => void moveTo(pending.angle, pending.words)}
      onClose={() => {
        if (question.peek() === pending) question.value = null;
      }}
    >
      {pending.cautions.map(said => (
        <Note key={said} kind="warning">
          {said}
        </Note>
      ))}
    </Confirm>
  );
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
  const speed = figureNow(one.uid, "current_speed");
  const torque = figureNow(one.uid, "current_torque");
  return (
    <div class="figures">
      <span>
        <small class="second">{words.angle}</small>
        <b class={stale ? "dim" : ""} data-testid="jog-angle">
          {angle(present)}
        </b>
        <UnitMark one={one} />
      </span>
      <span class="between small second">
        {on && gap !== null && (gap > THERE_DEG ? words.toGo(withUnit(number(gap, 1), "°")) : words.there)}
        <br />
        {speed.value !== null && torque.value !== null && (
          <span class={speed.stale || torque.stale ? "dim" : ""}>
            {words.drive(withUnit(number(speed.value, 0), "rpm"), withUnit(number(torque.value, 0), "%"))}
          </span>
        )}
      </span>
      <span class="right">
        <small class="k-intent">{words.command}</small>
        <b class="k-intent" data-testid="jog-command">
          {going !== null ? driveText(going.kind, going.value) : angle(on ? wanted : null)}
        </b>
      </span>
    </div>
  );
}
