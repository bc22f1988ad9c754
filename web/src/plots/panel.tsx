/** The frame of a plot: header with window, pause and reset, file export, lanes and cursors. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useMemo, useRef } from "preact/hooks";
import "./plots.css";
import { monotonic, now } from "../bench/clock";
import { age, clock, date, withUnit } from "../bench/format";
import { Icon } from "../kit/icon";
import { toCsv } from "../telemetry/csv";
import { type TelemetryStore, telemetry } from "../telemetry/store";
import type { MarkAt } from "./annotate";
import { PlotCursors } from "./cursors";
import type { Lane } from "./lane";
import { PlotLanes } from "./lanes";
import { marksOf, watchMarks } from "./marks";
import { recallSamples } from "./past";
import type { Plot } from "./plot";
import { pictureOf } from "./png";
import { type TimeSpan, WINDOWS } from "./span";
import { plots as words } from "./words";

interface Props {
  title: ComponentChildren;
  /** Granted rate, or the reason why no data arrives. */
  note: ComponentChildren;
  lanes: readonly Lane[];
  span: TimeSpan;
  store?: TelemetryStore;
  /** Label for screen readers and file names: channel and servo. */
  label: string;
  file: string;
  testid: string;
  /** Additional buttons of this plot. */
  tools?: ComponentChildren;
  /** Content between header and lanes, such as an open picker. */
  children?: ComponentChildren;
  /** Content instead of the lanes. */
  instead?: ComponentChildren;
  /** Content below the lanes. */
  foot?: ComponentChildren;
}

const NO_MARKS: readonly MarkAt[] = [];

export function PlotPanel(props: Props) {
  const { lanes, span, label, testid, store = telemetry } = props;
  const plots = useRef<(Plot | null)[]>([]);
  const uids = useMemo(() => new Set(lanes.flatMap(lane => lane.curves.map(one => one.uid))), [lanes]);
  const marks = useMemo(() => (store === telemetry ? () => marksOf(uids) : () => NO_MARKS), [store, uids]);
  const seconds = span.seconds.value;
  useEffect(() => (store === telemetry ? watchMarks() : undefined), [store]);
  useEffect(() => {
    if (store !== telemetry) return;
    for (const uid of uids) {
      const channels = lanes.flatMap(lane =>
        lane.curves.filter(one => one.uid === uid).map(one => one.channel),
      );
      void recallSamples(uid, channels, seconds);
    }
  }, [store, lanes, uids, seconds]);
  return (
    <section class="plot-panel" aria-label={label}>
      <header>
        <b>{props.title}</b>
        <span class="second small plot-rate" data-testid="plot-rate">
          {span.goesOn && !span.away ? props.note : ""}
        </span>
        <span class="grow" />
        <State span={span} store={store} />
      </header>
      <div class="plot-tools">
        {props.tools}
        {span.goesOn && (
          <label class="plot-window">
            <span class="hidden-text">{words.window}</span>
            <select
              data-testid="plot-window"
              value={String(seconds)}
              onChange={event => span.choose(Number(event.currentTarget.value))}
            >
              {WINDOWS.map(one => (
                <option key={one} value={String(one)}>
                  {one < 120 ? words.seconds(String(one)) : words.minutes(String(one / 60))}
                </option>
              ))}
            </select>
          </label>
        )}
        <button
          type="button"
          class="tool"
          data-testid="plot-cursors-button"
          aria-pressed={span.cursors.value.some(one => one !== null)}
          onClick={() => span.flipCursors()}
        >
          {words.cursors}
        </button>
        {span.goesOn && (
          <button
            type="button"
            class="tool"
            data-testid="plot-pause"
            aria-pressed={span.still.value !== null}
            onClick={() => (span.still.peek() ? span.follow() : span.pause())}
          >
            <Icon name={span.still.value === null ? "pause" : "play"} size={15} />
            {words.pause}
          </button>
        )}
        <span class="grow" />
        <button
          type="button"
          class="tool"
          data-testid="plot-png"
          title={words.pngTitle}
          aria-label={words.pngTitle}
          onClick={() => void savePicture(plots.current, props)}
        >
          <Icon name="download" size={15} />
          {words.png}
        </button>
        <button
          type="button"
          class="tool"
          data-testid="plot-csv"
          title={words.csvTitle}
          aria-label={words.csvTitle}
          onClick={() => saveSamples(props)}
        >
          <Icon name="download" size={15} />
          {words.csv}
        </button>
      </div>
      {props.children}
      {props.instead ?? <PlotLanes {...{ lanes, store, span, marks, label, testid, plots }} />}
      <PlotCursors {...{ lanes, store, span }} />
      {props.foot}
    </section>
  );
}

/** How long it has been paused, and the button back to live. */
function State({ span, store }: { span: TimeSpan; store: TelemetryStore }) {
  const stoodAt = useSignal(0);
  const still = span.still.value;
  useEffect(() => {
    if (still !== null) stoodAt.value = monotonic();
  }, [still === null]);
  if (!span.away || still === null) return null;
  const behind = span.goesOn && store === telemetry ? store.serverTime(now.value) - still.zero : Number.NaN;
  return (
    <>
      {Number.isFinite(behind) && (
        <span class="small second touch-hide plot-paused">{words.paused(age(Math.max(0, behind), 0))}</span>
      )}
      <button type="button" class="tool plot-back" data-testid="plot-live" onClick={() => span.follow()}>
        <Icon name="play" size={15} />
        {span.goesOn ? words.live : words.whole}
      </button>
    </>
  );
}

/** File name of a plot without extension: "hornbill-Elevator-L-20261122-014500". */
export function fileName(of: string, utc: number): string {
  const plain = of.replace(/[^\p{L}\p{N}_.-]+/gu, "-").replace(/^[-.]+|-+$/g, "") || "plot";
  const at = Number.isFinite(utc) ? `-${date(utc)}-${clock(utc)}`.replaceAll(":", "") : "";
  return `hornbill-${plain}${at}`;
}

type Filed = Pick<Props, "lanes" | "span" | "file" | "store" | "label">;

export function saveSamples({ lanes, span, file, store = telemetry }: Filed): void {
  const shown = span.shown();
  if (!shown) return;
  const curves = lanes.flatMap(lane => lane.curves);
  const several = new Set(curves.map(one => one.uid)).size > 1;
  const columns = curves.map(one => ({
    uid: one.uid,
    channel: one.channel,
    head: several ? `${one.name}/${one.channel}` : one.channel,
  }));
  const text = toCsv(store, columns, shown.from, shown.to);
  keep(new Blob([text], { type: "text/csv" }), `${fileName(file, shown.to + store.utcOffset)}.csv`);
}

export async function savePicture(plots: readonly (Plot | null)[], props: Filed): Promise<void> {
  const { lanes, span, label, file, store = telemetry } = props;
  const shown = span.shown();
  if (!shown) return;
  const [from, to] = [shown.from + store.utcOffset, shown.to + store.utcOffset];
  const when = Number.isFinite(to) ? words.span(`${date(from)} ${clock(from)}`, clock(to)) : "";
  const seen = plots.slice(0, lanes.length).map(one => one?.canvas ?? null);
  const picture = await pictureOf(seen, label, when || withUnit((shown.to - shown.from).toFixed(1), "s"));
  if (picture) keep(picture, `${fileName(file, to)}.png`);
}

function keep(file: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
