/** The panel of the frequency response: gain, phase and coherence, where they are reliable. */
import { useEffect, useRef } from "preact/hooks";
import type { StepRun } from "../api/lab-types";
import { number, signed, withUnit } from "../bench/format";
import { noteText, verdictText } from "../bench/note-text";
import { Button } from "../kit/button";
import { Plot } from "../plots/plot";
import { dialog } from "./dialogs";
import { COHERENCE, decadeTicks, frequencyPictures, responsesOf, type ShownResponse } from "./frequency";
import { gainsOf } from "./legend";
import { responses, testing } from "./state";
import { tune as words } from "./words";

interface Props {
  runs: readonly StepRun[];
  locked: boolean;
}

export function FrequencyPanel({ runs, locked }: Props) {
  const strings = words.frequency;
  const shown = responsesOf(runs, responses.value ?? []);
  const last = shown.at(-1)?.response;
  return (
    <section class="tune-panel" aria-label={strings.title} data-testid="frequency">
      <header>
        <h2>{strings.title}</h2>
        <span class="second small">
          {last
            ? strings.facts(
                withUnit(number(last.amplitude_deg, 1), "°"),
                withUnit(number(last.duration_s, 0), "s"),
              )
            : ""}
        </span>
        <Button
          live
          testid="frequency-open"
          disabled={locked || testing.value}
          onClick={() => {
            dialog.value = "response";
          }}
        >
          {strings.open}
        </Button>
      </header>
      {shown.length > 0 ? (
        <FrequencyPlots shown={shown} />
      ) : (
        <div class="tune-nothing">
          <p class="second">{strings.nothing}</p>
        </div>
      )}
    </section>
  );
}

/** Every 10 dB, or every 20 over a wide range. */
function decibels(low: number, high: number): number[] {
  const step = high - low > 60 ? 20 : 10;
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, at) => (first + at) * step);
}

const hertz = (hz: number) => withUnit(number(hz, hz < 10 ? 1 : 0), "Hz");

function FrequencyPlots({ shown }: { shown: readonly ShownResponse[] }) {
  const strings = words.frequency;
  const gain = useRef<HTMLDivElement>(null);
  const phase = useRef<HTMLDivElement>(null);
  const coherence = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLParagraphElement>(null);
  const plots = useRef<readonly Plot[]>([]);
  useEffect(() => {
    const common = {
      group: "tune-frequency",
      ruled: true,
      yWidth: 44,
      beside: 30,
      xTicks: decadeTicks,
      x: (value: number) => hertz(10 ** value).replace(".0", ""),
      readout: readout.current,
    };
    const read =
      (unit: string, decimals: number) => (x: number, values: readonly { name: string; value: number }[]) =>
        strings.at(
          hertz(10 ** x),
          values.map(one => `${one.name} ${withUnit(signed(one.value, decimals), unit)}`).join(", "),
        );
    const boxes = [
      [gain, { y: (v: number) => number(v, 0), yTicks: decibels, read: read("dB", 1), last: false }],
      [
        phase,
        {
          y: (v: number) => withUnit(number(v, 0), "°"),
          yTicks: (low: number, high: number) =>
            Array.from({ length: 40 }, (_, at) => -90 * at).filter(one => one >= low && one <= high),
          read: read("°", 0),
          last: false,
        },
      ],
      [coherence, { y: (v: number) => number(v, 0), yTicks: () => [0, 1], read: read("", 2) }],
    ] as const;
    plots.current = boxes.flatMap(([box, more]) =>
      box.current ? [new Plot(box.current, { ...common, ...more })] : [],
    );
    return () => {
      for (const one of plots.current) one.destroy();
    };
  }, []);
  useEffect(() => {
    const pictures = frequencyPictures(shown, {
      name: (one, amplitude) =>
        [
          one.letter ?? gainsOf(one.response),
          amplitude === null ? "" : `±${withUnit(number(amplitude, 1), "°")}`,
        ]
          .filter(Boolean)
          .join(" "),
      peak: (db, hz) => strings.peak(withUnit(signed(db, 0), "dB"), hertz(hz)),
      bandwidth: (letter, hz) => strings.bandwidth(letter ?? "", hertz(hz)),
      notReliable: strings.notReliable,
      gain: strings.gain,
      phase: strings.phase,
      coherence: strings.coherence,
      threshold: number(COHERENCE, 1),
    });
    const [first, second, third] = plots.current;
    first?.show(pictures.gain);
    second?.show(pictures.phase);
    third?.show(pictures.coherence);
  }, [shown.map(one => `${one.response.id}${one.letter}${one.place}`).join()]);
  const last = shown.at(-1);
  const names = shown.map(one => one.letter ?? gainsOf(one.response)).join(", ");
  return (
    <>
      <div
        class="tune-frequency"
        role="img"
        aria-label={strings.label(names)}
        data-testid="frequency-plot"
        data-runs={shown.length}
      >
        <div ref={gain} />
        <div ref={phase} />
        <div ref={coherence} />
      </div>
      <div class="tune-readout small second">
        <p ref={readout} aria-hidden="true" />
        <p class="when-idle" data-testid="frequency-verdict">
          {last &&
            [last.letter ?? "", verdictText(last.response.verdict), dependenceOf(last)]
              .filter(Boolean)
              .join(" ")}
        </p>
      </div>
    </>
  );
}

function dependenceOf({ response }: ShownResponse): string {
  const note = response.dependence;
  return note ? noteText(note.text, note.code, note.params) : "";
}
