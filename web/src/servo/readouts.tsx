/** Readouts: six figures and those a page adds, with units and tolerances, grey with their age once stale. */

import type { ComponentChildren } from "preact";
import type { Servo } from "../api/types";
import { type CommandShown, commandNow, driveText } from "../bench/activity";
import { servo } from "../bench/fleet";
import { age, angle, NONE, number, withUnit } from "../bench/format";
import { type Figure, figureNow } from "../bench/fresh";
import { text } from "../text";
import { UnitMark } from "./unit-mark";
import { servoWords } from "./words";

export function Readouts({ uid, children }: { uid: string; children?: ComponentChildren }) {
  const strings = servoWords.side;
  const present = figureNow(uid, "current_angle");
  const command = commandNow(uid);
  const speed = figureNow(uid, "current_speed");
  const torque = figureNow(uid, "current_torque");
  const board = figureNow(uid, "current_temperature");
  const supply = figureNow(uid, "current_voltage");
  const show = (live: Figure, decimals: number, unit: string) =>
    withUnit(live.value === null ? NONE : number(live.value, decimals), unit);
  return (
    <dl class="readouts">
      <Readout
        label={strings.angle}
        live={present}
        shown={angle(present.value)}
        testid="angle-readout"
        unitOf={servo(uid)}
      />
      <Readout
        label={strings.command}
        live={command.figure}
        shown={commandText(command)}
        testid="command-readout"
        intent={command.kind !== "none"}
      />
      <Readout label={strings.speed} live={speed} shown={show(speed, 0, "rpm")} testid="speed-readout" />
      <Readout
        label={strings.torque}
        live={torque}
        about={strings.about}
        shown={show(torque, 0, "%")}
        testid="torque-readout"
      />
      <Readout
        label={strings.board}
        live={board}
        shown={show(board, 0, "°C")}
        note={strings.boardTolerance}
        testid="temperature-readout"
      />
      <Readout
        label={strings.supply}
        live={supply}
        shown={show(supply, 1, "V")}
        note={strings.supplyTolerance}
        testid="voltage-readout"
      />
      {children}
    </dl>
  );
}

function commandText({ kind, figure }: CommandShown): string {
  if (kind === "none") return figure.stale ? NONE : servoWords.side.inactive;
  if (figure.value === null) return NONE;
  return kind === "angle" ? angle(figure.value) : driveText(kind, figure.value);
}

interface Props {
  label: string;
  live: Figure;
  shown: string;
  note?: string;
  /** Shown before the figure. */
  about?: string;
  testid: string;
  intent?: boolean;
  /** An angle of this servo: marked while its unit is in conflict. */
  unitOf?: Servo | undefined;
}

export function Readout({ label, live, shown, note, about, testid, intent = false, unitOf }: Props) {
  const old = live.stale && live.age !== null;
  return (
    <div data-stale={live.stale}>
      <dt class={intent && !live.stale ? "k-intent" : ""}>
        {old ? <b title={text.servos.head.age}>{`${label}, ${age(live.age ?? 0)}`}</b> : label}
      </dt>
      <dd class={live.stale ? "dim" : intent ? "k-intent" : ""} data-testid={testid}>
        {about && <span class="note">{about} </span>}
        {shown}
        {unitOf && <UnitMark one={unitOf} />}
        {note && <span class="note"> {note}</span>}
      </dd>
    </div>
  );
}
