/** One servo's row: horn, angle, name, state, the last 30 s, and its ROM state. */

import { useEffect, useRef } from "preact/hooks";
import { type KnownServo, nameOf, servo } from "../bench/fleet";
import { age, angle, NONE, number, withUnit } from "../bench/format";
import { angleNow, figureNow } from "../bench/fresh";
import { connection, up } from "../bench/link";
import { modelName } from "../bench/model";
import { romKnown, wantSheet } from "../bench/parameters";
import { besideAutopilot } from "../bench/role";
import { pathOf } from "../bench/route";
import { phone } from "../bench/screen";
import { conditionHere, limitsOf } from "../bench/servo-condition";
import { wiggled, wiggling } from "../bench/wiggle";
import { cell, Tick } from "../kit/field";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { lazy } from "../kit/lazy";
import { everyFrame } from "../plots/frames";
import { Sparkline } from "../plots/sparkline";
import { ConditionLines, wholeCondition } from "../servo/condition-lines";
import { LiveDial } from "../servo/live-dial";
import { UnitMark } from "../servo/unit-mark";
import { telemetry } from "../telemetry/store";
import { text } from "../text";
import { nameBelow } from "./grouping";
import { Nickname } from "./nickname";
import { isSelected, select } from "./selection";

const CommandCells = lazy<{ one: KnownServo }>(() =>
  import("../role/commanders").then(file => file.CommandCells),
);
const RowWiggle = lazy<{ one: KnownServo }>(() => import("./row-wiggle").then(file => file.RowWiggle));
const LostBadge = lazy<{ uid: string; name: string; n: number }>(() =>
  import("./drift-badge").then(file => file.LostBadge),
);
const DriftBadge = lazy<{ uid: string; name: string }>(() =>
  import("./drift-badge").then(file => file.DriftBadge),
);

export function ServoRow({ uid }: { uid: string }) {
  const one = servo(uid);
  const round = connection.value;
  const settled = one?.online === true && one.state !== "identifying" && one.state !== "restarting";
  const model = one?.model;
  // Read after each connection, restart and identification, not each time the row is shown.
  useEffect(() => {
    if (round > 0) wantSheet(uid, `${round} ${settled} ${model}`);
  }, [uid, round, settled, model]);
  const wiggles = wiggling.value && wiggled.value?.uid === uid;
  const row = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (wiggles) row.current?.scrollIntoView({ block: "nearest" });
  }, [wiggles]);
  if (!one) return null;
  const condition = conditionHere(one);
  const beside = besideAutopilot.value;
  return (
    <div
      ref={row}
      role="row"
      class={`servo-grid servo-row ${one.online ? "" : "away"}`}
      data-testid={`servo-row-${uid}`}
      data-kind={condition.kind}
      data-state={one.state}
      data-wiggles={wiggles}
    >
      <span role="cell" class="c-tick">
        <Tick
          label={text.servos.select(nameOf(one))}
          bare
          at={cell(isSelected(uid), on => select([uid], on))}
          testid={`select-${uid}`}
        />
      </span>
      <span role="cell" class="c-dial">
        <LiveDial one={one} size={56} />
      </span>
      <LiveAngle one={one} />
      <span role="cell" class="c-name">
        <NameCell one={one} />
      </span>
      <span role="cell" class="c-ids">
        <span>
          {one.servo_id ?? NONE} <span class="dim">/</span> {one.node_id ?? NONE}
        </span>
        <small>{text.servos.firmware(one.firmware ?? NONE)}</small>
      </span>
      <span role="cell" class="c-health" title={wholeCondition(condition)}>
        <Glyph kind={condition.kind} />
        <ConditionLines uid={uid} of={condition} />
      </span>
      <span role="cell" class="c-spark">
        <Spark one={one} />
      </span>
      <SupplyCell one={one} />
      {beside && <CommandCells one={one} />}
      {!beside && <AgeCell one={one} />}
      <span role="cell" class="c-rom small">
        <RomCell one={one} />
      </span>
      {phone.value && <RowWiggle one={one} />}
    </div>
  );
}

function LiveAngle({ one }: { one: KnownServo }) {
  const present = angleNow(one);
  return (
    <span role="cell" class={`c-angle right ${present.stale ? "dim" : ""}`} data-stale={present.stale}>
      {angle(present.value)}
      <UnitMark one={one} />
    </span>
  );
}

function NameCell({ one }: { one: KnownServo }) {
  const path = pathOf("overview", one.uid);
  const name = nameOf(one);
  return (
    <>
      <span class="name-line">
        <a
          class="row-link strong"
          href={path}
          title={text.servos.open(name)}
          data-turns=""
          onClick={event => follow(event, path)}
        >
          {nameBelow(name)}
        </a>
        <Nickname uid={one.uid} label={one.label} name={name} />
      </span>
      <small class="facts">
        {modelName(one)}
        {one.serial && (
          <>
            , <span>{one.serial}</span>
          </>
        )}
      </small>
    </>
  );
}

function Spark({ one }: { one: KnownServo }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const spark = useRef<Sparkline | null>(null);
  useEffect(() => {
    const box = canvas.current;
    if (!box) return undefined;
    const drawn = new Sparkline(box, telemetry, one.uid);
    spark.current = drawn;
    return everyFrame(box, 4, at => drawn.draw(at));
  }, [one.uid]);
  const limits = limitsOf(one.uid);
  const online = one.online && up.value;
  useEffect(() => {
    if (!spark.current) return;
    spark.current.limits = limits;
    spark.current.online = online;
    spark.current.noData = text.servos.noData;
  });
  return <canvas ref={canvas} class="spark" role="img" aria-label={text.servos.sparkline(nameOf(one))} />;
}

function SupplyCell({ one }: { one: KnownServo }) {
  const volt = figureNow(one.uid, "current_voltage");
  const degrees = figureNow(one.uid, "current_temperature");
  return (
    <span role="cell" class="c-supply">
      <span class={volt.stale ? "dim" : ""}>
        {withUnit(volt.value === null ? NONE : number(volt.value, 1), "V")}
      </span>
      <small class={degrees.stale ? "dim" : "second"}>
        {withUnit(degrees.value === null ? NONE : number(degrees.value, 0), "°C")}
      </small>
    </span>
  );
}

function AgeCell({ one }: { one: KnownServo }) {
  const present = angleNow(one);
  return (
    <span role="cell" class={`c-age small ${present.stale ? "strong" : "dim"}`}>
      {present.age === null ? NONE : age(present.age)}
    </span>
  );
}

function RomCell({ one }: { one: KnownServo }) {
  if ((one.drift ?? []).length > 0) return <DriftBadge uid={one.uid} name={nameOf(one)} />;
  if ((one.lost ?? []).length > 0)
    return <LostBadge uid={one.uid} name={nameOf(one)} n={(one.lost ?? []).length} />;
  if (one.unsaved.length > 0) {
    return (
      <span class="half k-intent">
        <Icon name="half" size={16} />
        {text.servos.ramOnly(one.unsaved.length)}
      </span>
    );
  }
  return <span class="dim">{romKnown(one) ? text.servos.saved : text.servos.notKnown}</span>;
}
