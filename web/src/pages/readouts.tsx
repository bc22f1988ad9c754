/** Owns the readouts: six figures with units and tolerances, grey with their age as soon as they are old. */
import type { Servo } from "../api/types";
import { age, angle, NONE, number, withUnit } from "../form/format";
import { now } from "../state/clock";
import { angleOf, servo } from "../state/fleet";
import { up } from "../state/link";
import { sheetOf } from "../state/parameters";
import { staleAfter, watched } from "../state/watch";
import { telemetry } from "../telemetry/store";
import { text } from "../text";
import { UnitMark } from "../ui/unit-mark";

export interface Live {
  value: number | null;
  age: number | null;
  stale: boolean;
}

/** A channel of the servo looked at, as it is now. */
export function liveOf(uid: string, key: string): Live {
  const at = now.value;
  const grant = watched.value;
  const hz = grant?.uid === uid && grant.channels.includes(key) ? grant.granted_hz : 1;
  const sample = telemetry.latest(uid, key, at);
  if (!sample) return { ...lastRead(uid, key, at), stale: true };
  const reachable = up.value && servo(uid)?.online === true;
  return { value: sample.value, age: sample.age, stale: !reachable || sample.age > staleAfter(hz) };
}

// Before the stream brings anything: what was read last, with its age.
function lastRead(uid: string, key: string, at: number): { value: number | null; age: number | null } {
  const one = servo(uid);
  if (key === "current_angle" && one) return angleOf(one, at);
  const reading = sheetOf(uid).reading(key).value;
  if (typeof reading?.value !== "number" || reading.readAt === null) return { value: null, age: null };
  return { value: reading.value, age: at - reading.readAt };
}

export function Readouts({ uid }: { uid: string }) {
  const said = text.side;
  const present = liveOf(uid, "current_angle");
  const command = liveOf(uid, "command_angle");
  const speed = liveOf(uid, "current_speed");
  const torque = liveOf(uid, "current_torque");
  const board = liveOf(uid, "current_temperature");
  const supply = liveOf(uid, "current_voltage");
  // The dummy reads as a gap: the command is then another kind of command, or none.
  const inactive = command.value === null && sheetOf(uid).reading("command_angle").value?.value === null;
  const show = (live: Live, decimals: number, unit: string) =>
    withUnit(live.value === null ? NONE : number(live.value, decimals), unit);
  return (
    <dl class="readouts">
      <Readout
        label={said.angle}
        live={present}
        shown={angle(present.value)}
        testid="angle-readout"
        unitOf={servo(uid)}
      />
      <Readout
        label={said.command}
        live={inactive ? { value: null, age: null, stale: false } : command}
        shown={inactive ? said.inactive : angle(command.value)}
        testid="command-readout"
        intent={!inactive}
      />
      <Readout label={said.speed} live={speed} shown={show(speed, 0, "rpm")} testid="speed-readout" />
      <Readout
        label={said.torque}
        live={torque}
        about={said.about}
        shown={show(torque, 0, "%")}
        testid="torque-readout"
      />
      <Readout
        label={said.board}
        live={board}
        shown={show(board, 0, "°C")}
        note={said.boardTolerance}
        testid="temperature-readout"
      />
      <Readout
        label={said.supply}
        live={supply}
        shown={show(supply, 1, "V")}
        note={said.supplyTolerance}
        testid="voltage-readout"
      />
    </dl>
  );
}

interface Props {
  label: string;
  live: Live;
  shown: string;
  note?: string;
  /** Said before the figure. */
  about?: string;
  testid: string;
  intent?: boolean;
  /** An angle of this servo: marked while its unit is not sure. */
  unitOf?: Servo | undefined;
}

function Readout({ label, live, shown, note, about, testid, intent = false, unitOf }: Props) {
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
