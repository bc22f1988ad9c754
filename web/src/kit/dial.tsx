/** The small dial: face, limit arc, horn and command. The product's mark in every row. */
import { angle as angleText } from "../bench/format";
import type { Limits } from "../bench/servo-condition";
import { arc, hornPath, polar, ticks, wholeTurns } from "./polar";

interface Props {
  size: number;
  angle: number | null;
  command?: number | null;
  limits?: Limits | null;
  stale?: boolean;
  /** Draws the path of the horn to this angle: the effect of a save. */
  goesTo?: number;
  /** Where the horn is about to move, from one angle clockwise to another. */
  sweep?: { from: number; to: number };
  label?: string;
}

const FACE = 40;
const MINOR = ticks(36, 39, 10, 30);
const MAJOR = ticks(34, 39, 30);

/** A ruled face with the horn. Stale: hollow horn, no limit arc. */
export function Dial({ size, angle, command, limits, stale = false, goesTo, sweep, label }: Props) {
  const fine = size >= 100;
  const hub = fine ? 6 : 8;
  const tip = fine ? 3 : 3.6;
  const length = fine ? 28 : 27;
  const horn = hornPath(hub, tip, length);
  const spread = limits ? limits.cw - limits.ccw : 0;
  const around = angle === null ? 0 : wholeTurns(angle);
  return (
    <svg
      class="dial"
      width={size}
      height={size}
      viewBox="-50 -50 100 100"
      role="img"
      aria-label={label ?? angleText(angle)}
    >
      <circle r={FACE} fill="var(--well)" stroke="var(--line)" stroke-width="1" />
      <path d={MINOR} stroke="var(--edge)" stroke-width={fine ? 0.8 : 1} opacity={fine ? 1 : 0.55} />
      <path d={MAJOR} stroke="var(--edge)" stroke-width={fine ? 1.1 : 1.6} />
      {limits && !stale && (
        <path
          d={arc(45.5, spread >= 360 ? -180 : limits.ccw, spread >= 360 ? 180 : limits.cw)}
          fill="none"
          stroke="var(--limit)"
          stroke-width={fine ? 2.4 : 3.6}
        />
      )}
      {sweep && <Sweep {...sweep} />}
      {goesTo !== undefined && angle !== null && <Way from={angle} to={goesTo} horn={horn} />}
      {command !== null && command !== undefined && !stale && (
        <Command angle={command} fine={fine} horn={horn} />
      )}
      {angle !== null && (
        <g transform={`rotate(${angle.toFixed(1)})`}>
          <path
            d={horn}
            fill={stale ? "var(--well)" : "var(--ink)"}
            stroke={stale ? "var(--ink-3)" : "none"}
            stroke-width="2"
          />
          {around === 0 && <circle r={fine ? 2.4 : 3} fill={stale ? "var(--ink-3)" : "var(--well)"} />}
        </g>
      )}
      {around !== 0 && (
        <text
          y="4"
          text-anchor="middle"
          font-size={fine ? 9 : 12}
          font-weight="600"
          fill={stale ? "var(--ink-3)" : "var(--well)"}
        >
          {Math.abs(around)}
        </text>
      )}
    </svg>
  );
}

/** The part of the limit arc that the horn will pass, with a dashed line at each end. */
function Sweep({ from, to }: { from: number; to: number }) {
  return (
    <g stroke="var(--intent)" fill="none">
      <path d={arc(45.5, from, Math.max(to, from + 1))} stroke-width="7" />
      {[from, to].map(end => {
        const a = polar(12, end);
        const b = polar(42, end);
        return (
          <path key={end} d={`M${a.x} ${a.y}L${b.x} ${b.y}`} stroke-width="1.2" stroke-dasharray="3 2.4" />
        );
      })}
    </g>
  );
}

function Command({ angle, fine, horn }: { angle: number; fine: boolean; horn: string }) {
  const at = polar(45.5, angle);
  return (
    <g stroke="var(--intent)" fill="none">
      {fine ? (
        <path
          d={horn}
          transform={`rotate(${angle.toFixed(1)})`}
          stroke-width="1.2"
          stroke-dasharray="3 2.4"
        />
      ) : (
        <path
          d="M0 0V-40"
          transform={`rotate(${angle.toFixed(1)})`}
          stroke-width="2"
          stroke-dasharray="4 3"
        />
      )}
      <circle cx={at.x} cy={at.y} r={fine ? 3 : 4.5} fill="var(--panel)" stroke-width={fine ? 1.6 : 3} />
    </g>
  );
}

function Way({ from, to, horn }: { from: number; to: number; horn: string }) {
  const low = Math.min(from, to);
  const high = Math.max(from, to);
  const end = polar(24, to + Math.sign(from - to) * 9);
  const a = polar(24, from);
  const sweep = from > to ? 0 : 1;
  const wedgeA = polar(FACE - 8, low);
  const wedgeB = polar(FACE - 8, high);
  const large = high - low > 180 ? 1 : 0;
  if (high - low < 2 || high - low > 355) return null;
  return (
    <g>
      <path
        d={`M0 0L${wedgeA.x} ${wedgeA.y}A${FACE - 8} ${FACE - 8} 0 ${large} 1 ${wedgeB.x} ${wedgeB.y}Z`}
        fill="var(--intent-bg)"
      />
      <g stroke="var(--intent)" fill="none" stroke-width="1.3">
        <path d={horn} transform={`rotate(${to})`} stroke-dasharray="3 2.4" />
        {high - low > 25 && (
          <g>
            <path d={`M${a.x} ${a.y}A24 24 0 ${large} ${sweep} ${end.x} ${end.y}`} />
            <path
              d="M-4 -3L0 0L-4 3"
              transform={`translate(${end.x} ${end.y}) rotate(${to + (from > to ? 180 : 0) + Math.sign(from - to) * 9})`}
            />
          </g>
        )}
      </g>
    </g>
  );
}
