/** The lanes of a plot on the page: their canvases, and what pointers and keys do on them. */
import { useEffect, useRef } from "preact/hooks";
import { number, withUnit } from "../bench/format";
import type { TelemetryStore } from "../telemetry/store";
import type { MarkAt } from "./annotate";
import { calmRange, keyOf, type Lane, type LaneCurve } from "./lane";
import { type Picture, Plot } from "./plot";
import { stepFrom } from "./reading";
import type { Cursor, TimeSpan } from "./span";
import { plots as words } from "./words";

/** Nearer than this a press is on a cursor; a finger is not as exact. */
const GRAB_PX = { mouse: 6, touch: 22 };
/** A press that moved less is no drag. */
const DRAG_PX = 6;

interface Props {
  lanes: readonly Lane[];
  store: TelemetryStore;
  span: TimeSpan;
  marks: () => readonly MarkAt[];
  label: string;
  testid: string;
  /** Filled with what is drawn, lane by lane, for a picture of it. */
  plots: { current: (Plot | null)[] };
  /** What cursors are called, and how they are placed. */
  cursors?: readonly [string, string];
  hint?: string;
  ruled?: boolean;
}

export function PlotLanes(props: Props) {
  const { lanes, store, span, marks, label, testid, plots } = props;
  const { cursors = words.letters, hint = words.place, ruled = false } = props;
  const first = lanes[0]?.curves[0];
  const names = lanes.flatMap(lane => lane.curves.map(one => one.name)).join("\n");
  const keys = (event: KeyboardEvent) => {
    const sign = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
    if (sign === 0 || event.altKey || event.ctrlKey || event.metaKey || !first) return;
    event.preventDefault();
    moveCursor(span, store, first, span.active, sign * (event.shiftKey ? 10 : 1));
  };
  return (
    <div
      class="plot-lanes"
      role="group"
      // biome-ignore lint/a11y/noNoninteractiveTabindex: arrow keys move its cursors
      tabIndex={0}
      aria-label={`${label}. ${hint}`}
      data-testid={testid}
      data-lanes={lanes.length}
      onKeyDown={keys}
    >
      {lanes.map((lane, place) => (
        <LaneBox
          key={`${lane.unit}/${place === 0}/${place === lanes.length - 1}`}
          lane={lane}
          first={place === 0}
          last={place === lanes.length - 1}
          {...{ store, span, marks, names, cursors, ruled }}
          told={made => {
            plots.current[place] = made;
          }}
        />
      ))}
    </div>
  );
}

/** To the next sample that was taken; the cursor is put in the middle if it was nowhere. */
export function moveCursor(
  span: TimeSpan,
  store: TelemetryStore,
  curve: LaneCurve,
  which: Cursor,
  places: number,
): void {
  span.pause();
  const shown = span.shown();
  if (!shown) return;
  const at = span.cursors.peek()[which];
  const from = at ?? (shown.from + shown.to) / 2;
  span.move(which, at === null ? from : stepFrom(store.ring(curve.uid, curve.channel).all(), from, places));
}

interface LaneProps {
  lane: Lane;
  first: boolean;
  last: boolean;
  store: TelemetryStore;
  span: TimeSpan;
  marks: () => readonly MarkAt[];
  /** Of all lanes, a line each. */
  names: string;
  cursors: readonly [string, string];
  ruled: boolean;
  told: (plot: Plot | null) => void;
}

function LaneBox({ lane, first, last, store, span, marks, names, cursors, ruled, told }: LaneProps) {
  const box = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  const unit = useRef(lane.unit);
  unit.current = lane.unit;
  useEffect(() => {
    if (!box.current) return undefined;
    const made = new Plot(box.current, {
      x: (v, step) => (Math.abs(v) < step * 1e-6 && !span.still.peek() ? words.now : timeText(v, step)),
      y: (v, step) => withUnit(number(v, step < 0.1 ? 2 : step < 1 ? 1 : 0), unit.current),
      cursors,
      ruled,
      span,
      first,
      last,
    });
    plot.current = made;
    told(made);
    const forget = pointer(box.current, made, span);
    return () => {
      forget();
      made.destroy();
      told(null);
    };
  }, [store, span, marks]);
  useEffect(
    () => plot.current?.show(lanePicture(lane, store, marks, names.split("\n"))),
    [lane, store, span, marks, names],
  );
  return <div ref={box} class="plot-lane" />;
}

/** What is shown of a lane: its curves out of a store. */
export function lanePicture(
  lane: Lane,
  store: TelemetryStore,
  marks: (() => readonly MarkAt[]) | undefined,
  names: readonly string[],
): Picture {
  return {
    curves: lane.curves.map(one => ({
      ...one,
      key: keyOf(one),
      samples: one.samples ?? ((from: number) => store.ring(one.uid, one.channel).since(from)),
      gaps: true,
      wraps: lane.unit === "°",
    })),
    ...(marks ? { marks } : {}),
    ...(lane.title ? { title: lane.title } : {}),
    ...(lane.level ? { level: lane.level } : {}),
    range: (drawn, before) => calmRange(drawn, lane.unit, before),
    names,
  };
}

export function timeText(s: number, step: number): string {
  if (step >= 60) return words.minutes(number(s / 60, step % 60 === 0 ? 0 : 1));
  if (step < 0.1) return words.milliseconds(number(s * 1000, 0));
  return words.seconds(number(s, step < 1 ? 1 : 0));
}

/** Press and release places a cursor, a drag from a cursor moves it, any other drag enlarges what was under it. */
function pointer(box: HTMLElement, plot: Plot, span: TimeSpan): () => void {
  let from: { x: number; t: number; grabbed: Cursor | null } | null = null;
  const clamped = (x: number) => {
    const face = box.querySelector(".u-over")?.getBoundingClientRect();
    return plot.timeAt(face ? Math.min(face.right, Math.max(face.left, x)) : x);
  };
  const down = (event: PointerEvent) => {
    const t = plot.timeAt(event.clientX);
    if (event.button !== 0 || t === null) return;
    const reach = GRAB_PX[event.pointerType === "touch" ? "touch" : "mouse"] * plot.secondsPerPixel;
    const grabbed = span.cursors.peek().findIndex(one => one !== null && Math.abs(one - t) <= reach);
    from = { x: event.clientX, t, grabbed: grabbed === 0 || grabbed === 1 ? grabbed : null };
    box.setPointerCapture(event.pointerId);
  };
  const move = (event: PointerEvent) => {
    const t = from && clamped(event.clientX);
    if (!from || t === null) return;
    if (from.grabbed !== null) span.move(from.grabbed, t);
    else if (span.drag.peek() || Math.abs(event.clientX - from.x) >= DRAG_PX) {
      // The picture would run away under the drag.
      span.pause();
      span.drag.value = { from: from.t, to: t };
    }
  };
  const up = (event: PointerEvent) => {
    const drag = span.drag.peek();
    span.drag.value = null;
    if (from && drag) span.zoom(drag.from, drag.to);
    else if (from && from.grabbed === null && Math.abs(event.clientX - from.x) < DRAG_PX) span.place(from.t);
    from = null;
  };
  const cancel = () => {
    span.drag.value = null;
    from = null;
  };
  const all = { pointerdown: down, pointermove: move, pointerup: up, pointercancel: cancel } as const;
  for (const [kind, act] of Object.entries(all)) box.addEventListener(kind, act as EventListener);
  return () => {
    for (const [kind, act] of Object.entries(all)) box.removeEventListener(kind, act as EventListener);
  };
}
