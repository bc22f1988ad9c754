/** The lanes of a plot on the page: canvases, and their pointer and key handling. */
import { useEffect, useRef } from "preact/hooks";
import { number, withUnit } from "../bench/format";
import { calm } from "../bench/screen";
import type { TelemetryStore } from "../telemetry/store";
import type { MarkAt } from "./annotate";
import { calmRange, keyOf, type Lane, type LaneCurve } from "./lane";
import { type Picture, Plot } from "./plot";
import { stepFrom } from "./reading";
import type { Cursor, TimeSpan } from "./span";
import { plots as words } from "./words";

/** A press within this distance grabs a cursor; larger for touch. */
const GRAB_PX = { mouse: 6, touch: 22 };
/** A press that moves less than this is not a drag. */
const DRAG_PX = 6;
/** Draws per second with reduced motion, instead of one for each frame of the screen. */
const CALM_HZ = 10;

interface Props {
  lanes: readonly Lane[];
  store: TelemetryStore;
  span: TimeSpan;
  marks: () => readonly MarkAt[];
  label: string;
  testid: string;
  /** Receives the drawn plots, lane by lane, for export as an image. */
  plots: { current: (Plot | null)[] };
  /** Names of the cursors, and the hint how to place them. */
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
          onPlot={made => {
            plots.current[place] = made;
          }}
        />
      ))}
    </div>
  );
}

/** Move a cursor to the next sample; an unplaced cursor is placed in the middle. */
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
  /** Readout lines of all lanes. */
  names: string;
  cursors: readonly [string, string];
  ruled: boolean;
  onPlot: (plot: Plot | null) => void;
}

function LaneBox({ lane, first, last, store, span, marks, names, cursors, ruled, onPlot }: LaneProps) {
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
      ...(calm.peek() ? { hz: CALM_HZ } : {}),
    });
    plot.current = made;
    onPlot(made);
    const forget = pointer(box.current, made, span);
    return () => {
      forget();
      made.destroy();
      onPlot(null);
    };
  }, [store, span, marks]);
  useEffect(
    () => plot.current?.show(lanePicture(lane, store, marks, names.split("\n"))),
    [lane, store, span, marks, names],
  );
  return <div ref={box} class="plot-lane" />;
}

/** The picture of a lane: its curves with samples from a store. */
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

/** Press and release places a cursor, dragging a cursor moves it, any other drag zooms. */
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
      // A following picture would move under the drag.
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
