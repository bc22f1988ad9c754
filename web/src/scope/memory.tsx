/** The memory strip: the last ten minutes of the first curve, and the part shown. */
import { useEffect, useRef } from "preact/hooks";
import { monotonic } from "../bench/clock";
import { Plot, roomy } from "../plots/plot";
import { TimeSpan } from "../plots/span";
import { telemetry } from "../telemetry/store";
import type { ScopeCurve } from "./acquire";
import { scope as words } from "./words";

const HZ = 4;

interface Props {
  span: TimeSpan;
  curves: readonly ScopeCurve[];
  seconds: number;
}

export function MemoryStrip({ span, curves, seconds }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  const first = curves[0];
  useEffect(() => {
    if (!box.current) return undefined;
    const all = new TimeSpan(() => telemetry.serverTime(monotonic()));
    all.seconds.value = seconds;
    const made = new Plot(box.current, {
      x: () => "",
      y: () => "",
      span: all,
      hz: HZ,
      last: false,
      over: (drawn, at, colours) => {
        const shown = span.shown();
        if (!shown) return;
        const { ctx, bbox } = drawn;
        const ratio = devicePixelRatio || 1;
        const left = Math.max(bbox.left, at.x(shown.from));
        ctx.strokeStyle = colours.ink;
        ctx.lineWidth = 1.5 * ratio;
        ctx.strokeRect(left, bbox.top, Math.max(3 * ratio, at.x(shown.to) - left), bbox.height);
      },
    });
    plot.current = made;
    return () => made.destroy();
  }, [span, seconds]);
  useEffect(() => {
    plot.current?.show({
      curves: first
        ? [
            {
              samples: from => telemetry.ring(first.uid, first.channel).since(from),
              colour: "ink",
              gaps: true,
              wraps: first.unit === "°",
            },
          ]
        : [],
      range: roomy(2),
    });
  }, [first?.uid, first?.channel]);
  const centre = (t: number) => {
    const end = telemetry.serverTime(monotonic());
    const half = span.seconds.peek() / 2;
    const middle = Math.min(end - half, Math.max(end - seconds + half, t));
    span.still.value = { from: middle - half, to: middle + half, zero: middle + half };
  };
  const point = (event: PointerEvent) => {
    if (event.buttons !== 1) return;
    const t = plot.current?.timeAt(event.clientX);
    if (t != null) centre(t);
  };
  const keys = (event: KeyboardEvent) => {
    const shown = span.shown();
    const sign = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
    if (event.key === "End") span.follow();
    else if (sign !== 0 && shown) centre((shown.from + shown.to) / 2 + (sign * (shown.to - shown.from)) / 2);
    else return;
    event.preventDefault();
  };
  const behind = span.still.value ? Math.round(span.still.value.to - telemetry.serverTime(monotonic())) : 0;
  return (
    <div class="scope-memory">
      <span class="small second">{words.memoryFrom}</span>
      <div
        ref={box}
        role="slider"
        tabIndex={0}
        aria-label={words.memory}
        aria-valuemin={-seconds}
        aria-valuemax={0}
        aria-valuenow={Math.max(-seconds, Math.min(0, behind))}
        data-testid="scope-memory"
        onPointerDown={point}
        onPointerMove={point}
        onKeyDown={keys}
      />
    </div>
  );
}
