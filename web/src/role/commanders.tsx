/** Cells of the list beside an autopilot: who commands a servo, the command, and the tracking error. */
import type { KnownServo } from "../bench/fleet";
import { angle, clock, NONE, number, withUnit } from "../bench/format";
import { sheetOf } from "../bench/parameters";
import { roleWords as words } from "./words";
import "./role.css";

const SCALE_DEG = 2;
const WIDTH = 88;
/** Above this the error is emphasised. */
const LARGE_DEG = 1;

export function CommandCells({ one }: { one: KnownServo }) {
  const by = one.commanded_by?.[0];
  const ours = by === undefined && one.command_deg !== null && one.output.state === "on";
  const error = by?.error_deg ?? null;
  return (
    <>
      <span role="cell" class="c-by">
        {by ? (
          <>
            <b>{words.node(by.node_id)}</b>
            <small title={by.name ?? ""}>
              {words.at(
                words.type[by.type],
                by.rate_hz === null ? words.noRate : withUnit(number(by.rate_hz, 1), "Hz"),
              )}
            </small>
          </>
        ) : (
          <>
            <span class={ours ? "strong" : "dim"}>{ours ? words.you : words.none}</span>
            <small>{afterTimeout(one)}</small>
          </>
        )}
      </span>
      <span role="cell" class="c-command right">
        {by?.command_deg != null ? (
          <span class="k-intent">{angle(by.command_deg)}</span>
        ) : ours && one.command_deg !== null ? (
          <span class="k-intent">{angle(one.command_deg)}</span>
        ) : (
          <span class="dim">{words.noCommand}</span>
        )}
        {by && <small>{clock(by.since)}</small>}
      </span>
      <span role="cell" class="c-error">
        {error === null ? (
          <span class="dim">{NONE}</span>
        ) : (
          <>
            <span class={Math.abs(error) > LARGE_DEG ? "strong" : ""}>{angle(error)}</span>
            <ErrorScale error={error} />
          </>
        )}
      </span>
    </>
  );
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
function ErrorScale({ error }: { error: number }) {
  const half = WIDTH / 2;
  const x = half + (half * Math.max(-SCALE_DEG, Math.min(SCALE_DEG, error))) / SCALE_DEG;
  let ticks = `M0 4.5H${WIDTH}`;
  for (let i = 0; i <= 8; i++) ticks += `M${(WIDTH * i) / 8} ${i % 4 === 0 ? 0 : 2}V4.5`;
  return (
    <svg
      class="error-scale"
      width={WIDTH + 2}
      height="12"
      viewBox={`-1 0 ${WIDTH + 2} 12`}
      aria-hidden="true"
    >
      <path d={ticks} stroke="var(--edge)" stroke-width="1" fill="none" />
      <path
        d={`M${half} 8.5H${x}`}
        stroke={Math.abs(error) > LARGE_DEG ? "var(--warning)" : "var(--ink)"}
        stroke-width="3"
      />
    </svg>
  );
}
