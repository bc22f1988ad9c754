/** The large dial: horn, command ghost, limit arc, and a draggable handle on it. */
import { useRef } from "preact/hooks";
import { angle as angleText } from "../bench/format";
import { touch } from "../bench/screen";
import type { Limits } from "../bench/servo-condition";
import { angleAt, arc, draggedTo, hornPath, polar, ticks, wholeTurns } from "../kit/polar";
import { text } from "../text";
import { CaseOutline } from "./case-outline";

interface Props {
  angle: number | null;
  command: number | null;
  limits: Limits | null;
  stale: boolean;
  /** Present while motion is on: called with the angle that a drag of the handle requests. */
  onDrag?: ((angle: number) => void) | undefined;
  locked?: boolean;
  /** Series with the case below the horn. */
  series?: string | null;
}

const FACE = 167;
const RIM = 177;
const HORN = hornPath(25, 10, 124);
const MINOR = ticks(FACE - 10, FACE - 2, 2, 10);
const MIDDLE = ticks(FACE - 14, FACE - 2, 10, 30);
const MAJOR = ticks(FACE - 20, FACE - 2, 30);
const NAMES = [0, 30, 60, 90, 120, 150, -150, -120, -90, -60, -30];
const HUB_TEETH = ticks(10, 14, 12);
const HOLES = [58, 78, 98, 116];

export function JogDial({ angle, command, limits, stale, onDrag, locked = false, series }: Props) {
  const face = useRef<SVGSVGElement>(null);
  const dragged = useRef<number | null>(null);
  const span = limits ? limits.cw - limits.ccw : 0;
  const full = span >= 360;
  const shown = command ?? angle ?? 0;
  const handle = onDrag && !locked && limits ? polar(RIM, shown) : null;

  const follow = (event: PointerEvent) => {
    const drawn = face.current?.getScreenCTM();
    if (!drawn || !limits || dragged.current === null) return;
    const x = (event.clientX - drawn.e) / drawn.a;
    const y = (event.clientY - drawn.f) / drawn.d;
    const next = draggedTo(angleAt(x, y), dragged.current, limits);
    if (next === null) return;
    dragged.current = next;
    onDrag?.(next);
  };
  const begin = (event: PointerEvent) => {
    if (event.button !== 0) return;
    event.preventDefault();
    dragged.current = shown;
    (event.currentTarget as Element).setPointerCapture(event.pointerId);
  };
  const end = () => {
    dragged.current = null;
  };

  return (
    <svg
      ref={face}
      class="jog-dial"
      viewBox="-218 -218 436 436"
      data-testid="jog-dial"
      role={onDrag && limits ? "slider" : "img"}
      aria-label={onDrag && limits ? text.motion.dial : angleText(angle)}
      {...(onDrag && limits ? slider(shown, limits, angle, command) : {})}
    >
      <defs>
        <pattern id="hatch" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
          <path d="M0 0V6" stroke="var(--edge)" stroke-width="2" />
        </pattern>
      </defs>
      {limits && !full && (
        <path
          d={arc(FACE - 4, limits.cw, limits.ccw + 360)}
          fill="none"
          stroke="url(#hatch)"
          stroke-width="9"
          opacity="0.7"
        />
      )}
      {/* Keyboard focus is shown as a ring around the face, because the box is as wide as the page. */}
      <circle class="dial-focus" r={RIM + 2} fill="none" />
      <circle r={FACE - 9} fill="var(--well)" />
      <circle r={FACE} fill="none" stroke="var(--line)" />
      <path d={MINOR} stroke="var(--edge)" opacity="0.6" />
      <path d={MIDDLE} stroke="var(--edge)" />
      <path d={MAJOR} stroke="var(--ink-2)" stroke-width="1.5" />
      {NAMES.map(name => {
        const at = polar(RIM + 25, name);
        const inside = !limits || (name >= limits.ccw && name <= limits.cw);
        return (
          <text
            key={name}
            x={at.x}
            y={at.y + 5}
            text-anchor="middle"
            font-size="16"
            fill={inside ? "var(--ink)" : "var(--ink-3)"}
          >
            {name === 0 ? "0°" : angleText(name).replace(".0", "").replace("+", "")}
          </text>
        );
      })}
      {series !== undefined && <CaseOutline series={series} />}
      {limits && !stale && (
        <g stroke="var(--limit)" fill="none">
          <path d={arc(RIM - 5, full ? -180 : limits.ccw, full ? 180 : limits.cw)} stroke-width="7" />
          {!full &&
            [limits.ccw, limits.cw].map(limit => {
              const a = polar(FACE - 24, limit);
              const b = polar(RIM - 2, limit);
              return <path key={limit} d={`M${a.x} ${a.y}L${b.x} ${b.y}`} stroke-width="2.5" />;
            })}
        </g>
      )}
      {command !== null && !stale && (
        <path
          d={HORN}
          transform={`rotate(${command.toFixed(1)})`}
          fill="none"
          stroke="var(--intent)"
          stroke-width="2"
          stroke-dasharray="6 5"
        />
      )}
      {angle !== null && <Horn angle={angle} stale={stale} />}
      {handle && (
        <g
          class="handle"
          transform={`translate(${handle.x} ${handle.y}) rotate(${shown.toFixed(1)})`}
          onPointerDown={begin}
          onPointerMove={follow}
          onPointerUp={end}
          onPointerCancel={end}
          onLostPointerCapture={end}
          data-testid="jog-handle"
        >
          <circle r={touch.value ? 32 : 24} fill="transparent" />
          <circle r="15" fill="var(--intent)" />
          <path
            d="M-5 5L-1 -5M-1 5L3 -5M3 5L7 -5"
            transform="translate(-1 0)"
            stroke="var(--well)"
            stroke-width="1.6"
          />
        </g>
      )}
    </svg>
  );
}

/** The dial as a slider: its keys are those of the jog pad, which steps within the limits. */
function slider(shown: number, limits: Limits, angle: number | null, command: number | null) {
  const at = Math.round(Math.min(limits.cw, Math.max(limits.ccw, shown)) * 10) / 10;
  return {
    // Preact writes SVG attributes as spelt here.
    tabindex: 0,
    "aria-valuemin": limits.ccw,
    "aria-valuemax": limits.cw,
    "aria-valuenow": at,
    "aria-valuetext": text.motion.dialText(angleText(command), angleText(angle)),
  };
}

function Horn({ angle, stale }: { angle: number; stale: boolean }) {
  const around = wholeTurns(angle);
  return (
    <>
      <g transform={`rotate(${angle.toFixed(1)})`}>
        <path
          d={HORN}
          fill={stale ? "var(--well)" : "var(--ink)"}
          stroke={stale ? "var(--ink-3)" : "none"}
          stroke-width="2"
        />
        {HOLES.map(hole => (
          <circle key={hole} cy={-hole} r="3.6" fill="var(--well)" />
        ))}
        <circle r="15" fill="var(--well)" />
        {around === 0 && (
          <>
            <path d={HUB_TEETH} stroke={stale ? "var(--ink-3)" : "var(--ink)"} stroke-width="1.2" />
            <circle r="5.5" fill={stale ? "var(--ink-3)" : "var(--ink)"} />
          </>
        )}
      </g>
      {around !== 0 && (
        <text y="6" text-anchor="middle" font-size="17" font-weight="600" fill="var(--ink)">
          {around > 0 ? `+${around}` : `−${-around}`}
        </text>
      )}
    </>
  );
}
