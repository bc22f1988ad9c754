/** Owns the plot panel: signal, achieved of requested rate, window, pause, export, and the plot itself. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import "uplot/dist/uPlot.min.css";
import { age, number, withUnit } from "../form/format";
import { liveOf } from "../pages/readouts";
import { AnglePlotter } from "../plots/plot";
import { monotonic, now } from "../state/clock";
import { nameOf, servo } from "../state/fleet";
import { CHANNELS, watched } from "../state/watch";
import { toCsv } from "../telemetry/csv";
import { telemetry } from "../telemetry/store";
import { text } from "../text/en";
import { Icon } from "./icon";

const WINDOWS = [10, 30] as const;

export function AnglePlot({ uid }: { uid: string }) {
  const box = useRef<HTMLDivElement>(null);
  const plotter = useRef<AnglePlotter | null>(null);
  const pausedAt = useSignal<number | null>(null);
  const seconds = useSignal<number>(WINDOWS[0]);
  const said = text.side;
  useEffect(() => {
    if (!box.current) return undefined;
    const drawn = new AnglePlotter(box.current, telemetry, uid, {
      angle: said.curveAngle,
      command: said.curveCommand,
      now: said.now,
      seconds: before => said.before(number(before, 0)),
      degrees: value => withUnit(number(value, 0), "°"),
    });
    plotter.current = drawn;
    return () => drawn.destroy();
  }, [uid]);
  const grant = watched.value?.uid === uid ? watched.value : null;
  const quiet = grant !== null && liveOf(uid, "current_angle").stale;
  useEffect(() => {
    if (!plotter.current) return;
    plotter.current.pausedAt = pausedAt.value;
    plotter.current.seconds = seconds.value;
    plotter.current.rateHz = grant?.granted_hz ?? 10;
  });
  const paused = pausedAt.value;
  const note = grant?.note ?? null;
  const nothing = note !== null && grant?.channels.length === 0;
  return (
    <section class="plot-panel">
      <header>
        <b>{said.angle}</b>
        <span class="second small">
          {note !== null && !nothing
            ? note
            : quiet
              ? text.servos.noData
              : grant
                ? said.rate(number(grant.granted_hz, 0), number(grant.requested_hz, 0))
                : said.rateUnknown}
        </span>
        <span class="grow" />
        {paused !== null && (
          <span class="small k-intent">{said.paused(age(Math.max(0, now.value - paused)))}</span>
        )}
        <button
          type="button"
          class="tool"
          aria-label={said.window}
          onClick={() => {
            seconds.value = seconds.value === WINDOWS[0] ? WINDOWS[1] : WINDOWS[0];
          }}
        >
          {said.windowS(seconds.value)}
        </button>
        <button
          type="button"
          class="tool"
          data-testid="plot-pause"
          aria-pressed={paused !== null}
          onClick={() => {
            pausedAt.value = paused === null ? monotonic() : null;
          }}
        >
          <Icon name={paused === null ? "pause" : "play"} size={15} />
          {paused === null ? said.pause : said.resume}
        </button>
        <button type="button" class="tool" data-testid="plot-export" onClick={() => save(uid, seconds.value)}>
          <Icon name="download" size={15} />
          {said.export}
        </button>
      </header>
      {nothing && (
        <p class="plot plot-note second" data-testid="plot-note">
          {note}
        </p>
      )}
      <div
        ref={box}
        hidden={nothing}
        class="plot"
        data-testid="plot-angle"
        role="img"
        aria-label={said.plotLabel(nameOf(servo(uid)))}
      />
    </section>
  );
}

function save(uid: string, seconds: number): void {
  const file = new Blob([toCsv(telemetry, uid, CHANNELS, seconds)], { type: "text/csv" });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(file);
  link.download = `${nameOf(servo(uid)).replace(/[^\w-]+/g, "_")}.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
