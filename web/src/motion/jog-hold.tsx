/** The speed and torque tabs of the jog pad: value, cautions, and two buttons that run while held. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { callApi } from "../api/client";
import type { Caution } from "../api/types";
import { catalog } from "../bench/catalog";
import { cautionText } from "../bench/caution-text";
import { servo } from "../bench/fleet";
import { number, withUnit } from "../bench/format";
import { brake, held, press, pressByKey, pressByPointer, type RunKind } from "../bench/hold-to-run";
import { up } from "../bench/link";
import { movingTogether } from "../bench/motion";
import { check } from "../bench/number";
import { sheetOf } from "../bench/parameters";
import { pathOf } from "../bench/route";
import { cell, TextField, Tick } from "../kit/field";
import { follow } from "../kit/follow";
import { Note } from "../kit/note";
import { jogging as words } from "./words";

const UNIT = { speed: "rpm", torque: "%" } as const;
const FIRST = { speed: "20", torque: "10" } as const;
/** The specification allows 10 to 150 rpm; used while the servo's own limits have not been read. */
const MOST = { speed: 150, torque: 100 } as const;

/** Why a servo cannot be commanded by speed or torque now. */
function Refused({ uid }: { uid: string }) {
  const sheet = sheetOf(uid);
  const one = servo(uid);
  if (movingTogether.value !== null) return <p class="second">{words.singleOnly}</p>;
  const has = sheet.keys.value?.includes("speed_torque_control") ?? true;
  if (!has) return <p class="second">{words.unsupported(one?.firmware ?? "")}</p>;
  const path = pathOf("parameters", uid, "speed_torque_control");
  return (
    <p class="no-effect" data-testid="hold-no-effect">
      <span aria-hidden="true">⊘</span> {words.noEffect}{" "}
      <a class="link" href={path} onClick={event => follow(event, path)}>
        {words.goTo}
      </a>
    </p>
  );
}

/** Cautions are requested for the smallest usable value, so that they do not include "too small". */
const SMALLEST = 10;

export function JogHold({ uid, kind, able }: { uid: string; kind: RunKind; able: boolean }) {
  const sheet = sheetOf(uid);
  const typed = useSignal<string>(FIRST[kind]);
  const free = useSignal(false);
  const said = useSignal<readonly Caution[] | null>(null);
  const allowed = sheet.held("speed_torque_control") === true && movingTogether.value === null;
  const limits = { cw: limit(uid, kind, "cw"), ccw: limit(uid, kind, "ccw") };
  const most = Math.max(limits.cw, limits.ccw);
  const verdict = check(typed.value, { unit: UNIT[kind], perUnit: 1, minimum: 0, maximum: most });
  const value = verdict.ok && verdict.value > 0 ? verdict.value : null;
  const why = verdict.ok ? (verdict.value > 0 ? null : words.aboveZero) : `${verdict.what} ${verdict.remedy}`;
  useEffect(() => {
    if (!allowed) return;
    callApi("GET", "/servos/{uid}/cautions", { path: { uid }, query: { type: kind, value: SMALLEST } }).then(
      found => {
        said.value = found;
      },
      () => {
        said.value = [];
      },
    );
  }, [uid, kind, allowed]);
  useEffect(() => brake, [uid, kind]);
  if (!allowed) return <Refused uid={uid} />;

  const cautions = said.value;
  const runs = (direction: 1 | -1) =>
    able && up.value && free.value && value !== null && value <= (direction > 0 ? limits.cw : limits.ccw);
  const keys = (event: KeyboardEvent) => {
    const direction = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    const onButton = (event.target as HTMLElement).dataset.direction;
    const pressed = event.key === "Enter" || event.key === " " ? Number(onButton ?? 0) : direction;
    if (pressed === 0 || (event.target as HTMLElement).tagName === "INPUT" || event.ctrlKey || event.metaKey)
      return;
    event.stopPropagation();
    if (value !== null && runs(pressed > 0 ? 1 : -1)) pressByKey(event, kind, pressed * value);
    else event.preventDefault();
  };
  const going = held.value;
  return (
    <div
      class="hold"
      role="group"
      aria-label={words.tab[kind]}
      onKeyDown={keys}
      data-testid="hold"
      data-running={going !== null}
    >
      <div class="hold-how">
        <TextField
          label={words.value[kind]}
          at={cell(typed.value, next => {
            brake();
            typed.value = next;
          })}
          number
          unit={UNIT[kind]}
          error={why !== null}
          testid="hold-value"
        />
        <p class="small second">
          {words.range(shown(limits.ccw, kind), shown(limits.cw, kind))} {words.hint[kind]}
        </p>
      </div>
      <Note>{why}</Note>
      <div class="hold-said" data-testid="hold-said">
        {cautions?.map(one => (
          <Note key={one.code} kind={one.level}>
            {cautionText(one, uid)}
          </Note>
        ))}
        <Note kind="warning">{!cautions?.length && words.continuous}</Note>
      </div>
      {/* Not before the cautions, which move the tick and the buttons. */}
      <Tick
        label={words.free}
        disabled={cautions === null}
        at={cell(free.value, on => {
          brake();
          free.value = on;
        })}
        testid="hold-free"
      />
      <div class="hold-buttons">
        {([-1, 1] as const).map(direction => (
          <button
            key={direction}
            type="button"
            class="button hold-button"
            data-direction={direction}
            data-testid={direction > 0 ? "hold-cw" : "hold-ccw"}
            data-held={going !== null && Math.sign(going.value) === direction}
            aria-pressed={going !== null && Math.sign(going.value) === direction}
            disabled={!runs(direction)}
            onPointerDown={event => {
              if (value !== null) pressByPointer(event, still => press(kind, direction * value, still));
            }}
            onLostPointerCapture={brake}
            onBlur={brake}
            onContextMenu={event => event.preventDefault()}
          >
            <b>
              {direction < 0 && <kbd>←</kbd>} {direction > 0 ? words.cw : words.ccw}{" "}
              {direction > 0 && <kbd>→</kbd>}
            </b>
            <small>
              {going !== null && Math.sign(going.value) === direction
                ? words.runs(shown(Math.abs(going.value), kind))
                : words.hold}
            </small>
          </button>
        ))}
      </div>
      <p class="small second">{words.released}</p>
    </div>
  );
}

/** Largest value in a direction: the row's range, reduced to the servo's limit. */
function limit(uid: string, kind: RunKind, direction: "cw" | "ccw"): number {
  const row = catalog.value?.rows.get(`command_${kind}`);
  const reading = sheetOf(uid).reading(`command_${kind}`).value;
  const range = reading?.maximum ?? (row?.maximum ?? MOST[kind]) / (row?.per_unit ?? 1);
  const own = sheetOf(uid).held(`${kind}_limit_${direction}`);
  return Math.floor(typeof own === "number" ? Math.min(range, Math.abs(own)) : range);
}

function shown(value: number, kind: RunKind): string {
  return withUnit(number(value, 0), UNIT[kind]);
}
