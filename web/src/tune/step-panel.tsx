/** The panel of the step response: its plot, the direction, and the button that measures. */
import { useEffect, useRef } from "preact/hooks";
import type { StepRun } from "../api/lab-types";
import { angle, number, withUnit } from "../bench/format";
import { Button } from "../kit/button";
import { Segments } from "../kit/segments";
import { Plot } from "../plots/plot";
import { dialog } from "./dialogs";
import { ms } from "./legend";
import { testing } from "./state";
import { stepPicture } from "./step-picture";
import * as lab from "./step-runs";
import { tune as words } from "./words";

interface Props {
  runs: StepRun[];
  direction: { value: lab.Direction };
  locked: boolean;
}

export function StepPanel({ runs, direction, locked }: Props) {
  const strings = words.step;
  const side = direction.value;
  const last = runs.at(-1);
  const moved = last && lab.stepsOf(last, side)[0];
  return (
    <section class="tune-panel" aria-label={strings.title}>
      <header>
        <h2>{strings.title}</h2>
        <span class="second small">
          {last && moved
            ? strings.facts(angle(moved.from_deg), angle(moved.to_deg), number(last.achieved_hz, 0))
            : ""}
        </span>
        {last && (
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
        )}
        <Button
          live
          testid="step-open"
          disabled={locked || testing.value}
          onClick={() => {
            dialog.value = "step";
          }}
        >
          {strings.open}
        </Button>
      </header>
      {last ? <StepPlot runs={runs} side={side} /> : <NoStep />}
    </section>
  );
}

function NoStep() {
  return (
    <div class="tune-nothing">
      <p class="second">{words.step.nothing}</p>
    </div>
  );
}

function StepPlot({ runs, side }: { runs: StepRun[]; side: lab.Direction }) {
  const strings = words.step;
  const box = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLParagraphElement>(null);
  const plot = useRef<Plot | null>(null);
  useEffect(() => {
    if (!box.current) return undefined;
    const made = new Plot(box.current, {
      readout: readout.current,
      yWidth: 44,
      beside: 44,
      x: value => ms(value),
      y: (value, step) => withUnit(number(value, step < 1 ? 1 : 0), "°"),
      read: (time, values) =>
        strings.at(ms(time), values.map(one => strings.one(one.name, angle(one.value))).join(", ")),
    });
    plot.current = made;
    return () => made.destroy();
  }, []);
  useEffect(() => {
    const { window, ...picture } = stepPicture(runs, side, {
      band: deg => strings.band(withUnit(number(deg, 1), "°")),
      settled: (name, s) => strings.settled(name, ms(s)),
      hunts: (hz, rms) =>
        strings.hunts(
          hz === null ? null : withUnit(number(hz, 0), "Hz"),
          withUnit(number(rms * Math.SQRT2, 1), "°"),
        ),
    });
    plot.current?.show(picture);
    plot.current?.look(window);
  }, [runs, side]);
  const names = runs.map((_, place) => words.runs.label(lab.letter(place))).join(", ");
  return (
    <>
      <div
        ref={box}
        class="tune-canvas"
        role="img"
        data-testid="step-plot"
        data-runs={runs.length}
        aria-label={strings.label(names, side === "there" ? strings.there : strings.back)}
      />
      <div class="tune-readout small second">
        <p ref={readout} aria-hidden="true" />
        <p class="touch-hide when-idle">{strings.hint}</p>
      </div>
    </>
  );
}
