/** The plot of step tests and its legend: line, shape and letter of each run. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { StepRun } from "../api/lab-types";
import { angle, number, withUnit } from "../bench/format";
import { Segments } from "../kit/segments";
import { Plot } from "../plots/plot";
import { shape } from "../plots/shapes";
import { stepPicture } from "./step-picture";
import * as lab from "./step-runs";
import { tune as words } from "./words";

const FIRST_S = 0.3;

export function StepPlotPanel({
  runs: shown,
  direction,
}: {
  runs: StepRun[];
  direction: { value: lab.Direction };
}) {
  const box = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLParagraphElement>(null);
  const plot = useRef<Plot | null>(null);
  const first = useSignal(false);
  const strings = words.plot;
  useEffect(() => {
    if (!box.current) return undefined;
    const made = new Plot(box.current, {
      readout: readout.current,
      x: value => ms(value),
      y: (value, step) => withUnit(number(value, step < 1 ? 1 : 0), "°"),
      read: (time, values) =>
        strings.at(ms(time), values.map(one => strings.one(one.name, angle(one.value))).join(", ")),
    });
    plot.current = made;
    return () => made.destroy();
  }, []);
  const side = direction.value;
  useEffect(() => {
    const picture = stepPicture(shown, side, shown.at(-1)?.id ?? null, deg =>
      strings.band(withUnit(number(deg, 1), "°")),
    );
    plot.current?.show(picture);
    plot.current?.look(first.value ? [picture.from ?? 0, Math.min(FIRST_S, picture.to ?? FIRST_S)] : null);
  }, [shown, side, first.value]);
  const names = shown.map((_, place) => words.runs.label(lab.letter(place))).join(", ");
  return (
    <section class="tune-plot" aria-label={strings.title}>
      <header>
        <h2>{strings.title}</h2>
        <Legend runs={shown} />
        <Segments<lab.Direction>
          label={strings.direction}
          chosen={side}
          onChoose={key => {
            direction.value = key;
          }}
          options={[
            { key: "there", label: strings.there },
            { key: "back", label: strings.back },
          ]}
        />
        <Segments<"all" | "first">
          label={strings.window}
          chosen={first.value ? "first" : "all"}
          onChoose={key => {
            first.value = key === "first";
          }}
          options={[
            { key: "all", label: strings.all },
            { key: "first", label: strings.first(ms(FIRST_S)) },
          ]}
        />
      </header>
      <div
        ref={box}
        class="tune-canvas"
        role="img"
        data-testid="step-plot"
        data-runs={shown.length}
        aria-label={strings.label(names, side === "there" ? strings.there : strings.back)}
      />
      <div class="tune-readout small second">
        <p ref={readout} aria-hidden="true" />
        <p class="touch-hide when-idle">{strings.hint}</p>
      </div>
    </section>
  );
}

/** Line, shape and letter of a run. */
export function Swatch({ place, alone }: { place: number; alone: boolean }) {
  const colour = alone ? "var(--ink)" : `var(--series-${(place % 8) + 1})`;
  return (
    <svg class="swatch" width="34" height="14" viewBox="-17 -7 34 14" aria-hidden="true">
      <path d="M-17 0H17" stroke={colour} stroke-width="2" />
      {!alone && <path d={shape(place)} fill={colour} />}
    </svg>
  );
}

function Legend({ runs: shown }: { runs: StepRun[] }) {
  return (
    <ul class="tune-legend" data-testid="step-legend">
      {shown.map((run, place) => (
        <li key={run.id} data-testid={`legend-${lab.letter(place)}`}>
          <Swatch place={place} alone={shown.length === 1} />
          <b>{lab.letter(place)}</b>
          <span>{gainsOf(run)}</span>
        </li>
      ))}
      <li>
        <svg class="swatch" width="34" height="14" viewBox="-17 -7 34 14" aria-hidden="true">
          <path d="M-17 0H17" stroke="var(--intent)" stroke-width="2" stroke-dasharray="7 5" />
        </svg>
        <span class="second">{words.plot.target}</span>
      </li>
    </ul>
  );
}

export function gainsOf(run: StepRun): string {
  return [
    ["P", run.parameters.angle_p_gain],
    ["D", run.parameters.angle_d_gain],
  ]
    .flatMap(([name, value]) => (typeof value === "number" ? `${name} ${number(value, 0)}` : []))
    .join(", ");
}

/** Milliseconds, with at most one decimal. */
export function ms(s: number): string {
  const millis = s * 1000;
  return withUnit(number(millis, Math.abs(millis) < 9.95 && millis % 1 !== 0 ? 1 : 0), "ms");
}
