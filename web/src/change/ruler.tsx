/**
 * Drawing of a row's range: ink bar = RAM, blue ring = staged, open triangle = default, chevron = beyond. A drag stages
 * a value, like the box does by keyboard.
 */
import { useRef } from "preact/hooks";
import { ruler } from "../kit/ruler";
import { placeOnScale, type Scale, valueOnScale } from "./scale";

interface Props {
  scale: Scale;
  held: number | null;
  standard: number | null;
  staged: number | null;
  beyond: "above" | "below" | null;
  label: string;
  /** Called with the value under the pointer during a drag; absent if read-only. */
  onDrag?: (value: number) => void;
  onDrop?: () => void;
  /** Called when the default mark is pressed. */
  onStandard?: () => void;
}

const WIDTH = 112;
const LINE = 13;
const PARTS = 10;

/** A touch that scrolls must not change a value: a drag must start at the mark. */
const NEAR = 24;

export function Ruler({ scale, held, standard, staged, beyond, label, onDrag, onDrop, onStandard }: Props) {
  const x = (value: number) => placeOnScale(value, scale) * WIDTH;
  const drawing = useRef<SVGSVGElement>(null);
  const dragging = useRef(false);
  const follow = (event: PointerEvent) => {
    const left = drawing.current?.getBoundingClientRect().left ?? 0;
    onDrag?.(valueOnScale((event.clientX - left - 8) / WIDTH, scale));
  };
  const begin = (event: PointerEvent) => {
    const mark = staged ?? held;
    const left = drawing.current?.getBoundingClientRect().left ?? 0;
    if (!onDrag || mark === null || event.button !== 0) return;
    // Touch has the default in its column: a tap here could be a scroll.
    if (event.pointerType === "mouse" && (event.target as Element).closest(".standard")) {
      event.preventDefault();
      onStandard?.();
      return;
    }
    if (event.pointerType !== "mouse" && Math.abs(event.clientX - left - 8 - x(mark)) > NEAR) return;
    dragging.current = true;
    drawing.current?.setPointerCapture(event.pointerId);
    event.preventDefault();
    if (event.pointerType === "mouse") follow(event);
  };
  const end = () => {
    if (!dragging.current) return;
    dragging.current = false;
    onDrop?.();
  };
  return (
    <svg
      ref={drawing}
      class={onDrag ? "ruler drag" : "ruler"}
      onPointerDown={begin}
      onPointerMove={event => {
        if (dragging.current) follow(event);
      }}
      onPointerUp={end}
      onPointerCancel={end}
      width={WIDTH + 20}
      height="28"
      viewBox={`-8 0 ${WIDTH + 20} 28`}
      role="img"
      aria-label={label}
    >
      <path d={TICKS} stroke="var(--edge)" fill="none" />
      {staged !== null && held !== null && (
        <path d={`M${x(held)} ${LINE}H${x(staged)}`} stroke="var(--intent)" stroke-width="2" />
      )}
      {standard !== null && (
        <g class={onStandard ? "standard" : ""}>
          {onStandard && (
            <rect x={x(standard) - 8} y="17" width="16" height="11" fill="none" pointer-events="all" />
          )}
          <path d={`M${x(standard)} 19l3.6 6.5h-7.2z`} fill="none" stroke="var(--ink-3)" stroke-width="1.2" />
        </g>
      )}
      {held !== null && <path d={`M${x(held)} 5.5V20`} stroke="var(--ink)" stroke-width="3" />}
      {staged !== null && (
        <circle cx={x(staged)} cy={LINE} r="5.5" fill="var(--well)" stroke="var(--intent)" stroke-width="2" />
      )}
      {beyond && (
        <path
          d={beyond === "above" ? `M${WIDTH + 4} 6l5 7-5 7` : "M-3 6l-4 7 4 7"}
          fill="none"
          stroke="var(--failure)"
          stroke-width="2"
        />
      )}
    </svg>
  );
}

const TICKS = ruler(WIDTH, PARTS, LINE, i => (i % (PARTS / 2) === 0 ? 6 : 9));
