/** Cells of the list beside an autopilot: who commands a servo, the command, and the tracking error. */
import { monotonic } from "../bench/clock";
import type { KnownServo } from "../bench/fleet";
import { angle, clock, NONE, number, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { sheetOf } from "../bench/parameters";
import { commandedHere, commanderOf } from "../bench/role";
import { ruler } from "../kit/ruler";
import { roleWords as words } from "./words";
import "./role.css";

const SCALE_DEG = 2;
const WIDTH = 88;
/** Above this for so long the error is emphasised. */
const LARGE_DEG = 1;
const LARGE_S = 2;

export function CommandCells({ one }: { one: KnownServo }) {
  const by = commanderOf(one);
  const ours = by === undefined && commandedHere.value.includes(one.uid);
  const command = by ? by.command_deg : ours ? one.command_deg : null;
  const error = by?.error_deg ?? (ours && command !== null ? errorOf(one, command) : null);
  const large = lasts(one.uid, error !== null && Math.abs(error) > LARGE_DEG);
  return (
    <>
      <span role="cell" class="c-by">
        {by ? (
          <>
            <span title={by.name ?? ""}>
              <b>{words.node(by.node_id)}</b>
              <span class="by-type">{words.typed(words.type[by.type])}</span>
            </span>
            <small>
              {by.rate_hz === null ? words.noRate : withUnit(number(by.rate_hz, 1), "Hz")}
              <span class="by-since"> {words.since(clock(by.since))}</span>
            </small>
          </>
        ) : (
          <>
            <span class={ours ? "" : "dim"}>
              {ours ? <b>{words.you}</b> : one.online ? words.none : NONE}
            </span>
            <small>{ours ? words.holds : one.online ? afterTimeout(one) : ""}</small>
          </>
        )}
      </span>
      <span role="cell" class="c-command right">
        {command === null ? (
          <span class="dim">{by || !one.online ? NONE : words.noCommand}</span>
        ) : (
          <span class="k-intent">{angle(command)}</span>
        )}
      </span>
      <span role="cell" class="c-error">
        {error === null ? (
          <span class="dim">{NONE}</span>
        ) : (
          <>
            <span class={large ? "strong" : ""}>{angle(error)}</span>
            <ErrorScale error={error} large={large} />
          </>
        )}
      </span>
    </>
  );
}

function errorOf(one: KnownServo, command: number): number | null {
  const { value, stale } = angleNow(one);
  return value === null || stale ? null : value - command;
}

const largeSince = new Map<string, number>();

/** Whether it has been so for LARGE_S: a horn on its way is always behind its command. */
function lasts(uid: string, large: boolean): boolean {
  if (!large) {
    largeSince.delete(uid);
    return false;
  }
  const at = monotonic();
  const since = largeSince.get(uid) ?? at;
  largeSince.set(uid, since);
  return at - since >= LARGE_S;
}

/** The heads of these cells. */
export function CommandHeads() {
  return (
    <>
      <span role="columnheader" class="c-by">
        {words.by}
      </span>
      <span role="columnheader" class="c-command right">
        {words.command}
      </span>
      <span role="columnheader" class="c-error">
        {words.error}
      </span>
    </>
  );
}

/** What the servo does without commands (0x26, 0x27). */
function afterTimeout(one: KnownServo): string {
  const sheet = sheetOf(one.uid);
  const action = sheet.reading("timeout_action").value?.ram;
  const after = sheet.reading("timeout_time").value?.ram;
  if (action !== "off" && action !== "hold" && action !== "brake") return "";
  return words.timeout[action](typeof after === "number" ? withUnit(number(after / 1000, 1), "s") : NONE);
}

/** A centred ruled scale of ±2° with a bar from its centre. */
function ErrorScale({ error, large }: { error: number; large: boolean }) {
  const half = WIDTH / 2;
  const x = half + (half * Math.max(-SCALE_DEG, Math.min(SCALE_DEG, error))) / SCALE_DEG;
  return (
    <svg
      class="error-scale"
      width={WIDTH + 2}
      height="12"
      viewBox={`-1 0 ${WIDTH + 2} 12`}
      aria-hidden="true"
    >
      <path
        d={ruler(WIDTH, 8, 4.5, i => (i % 4 === 0 ? 0 : 2))}
        stroke="var(--edge)"
        stroke-width="1"
        fill="none"
      />
      <path d={`M${half} 8.5H${x}`} stroke={large ? "var(--warning)" : "var(--ink)"} stroke-width="3" />
    </svg>
  );
}
