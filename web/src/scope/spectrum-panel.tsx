/** The spectrum between the cursors: amplitude over frequency, with the highest peak of each curve. */
import { useEffect, useMemo, useRef } from "preact/hooks";
import { number, withUnit } from "../bench/format";
import { Plot, roomy } from "../plots/plot";
import type { TimeSpan } from "../plots/span";
import { still } from "../plots/trace";
import { telemetry } from "../telemetry/store";
import type { ScopeCurve } from "./acquire";
import { highestPeak, spectrumOf } from "./spectrum";
import { scope as words } from "./words";

export function SpectrumPanel({ span, curves }: { span: TimeSpan; curves: readonly ScopeCurve[] }) {
  const [a, b] = span.cursors.value;
  const unit = curves[0]?.unit ?? "";
  const found = useMemo(() => {
    if (a === null || b === null) return [];
    // One axis: the measured curves of the first lane.
    return curves
      .filter(one => one.unit === unit && !one.dashed)
      .flatMap(curve => {
        const spectrum = spectrumOf(telemetry.ring(curve.uid, curve.channel).all(), a, b);
        return spectrum ? { curve, spectrum, peak: highestPeak(spectrum) } : [];
      });
  }, [a, b, curves.map(one => one.letter + one.uid + one.channel).join(" ")]);
  if (a === null || b === null) return null;
  const finest = found[0]?.spectrum.resolution;
  return (
    <section class="scope-spectrum" aria-label={words.spectrum}>
      <header>
        <h2>{words.spectrum}</h2>
        <span class="small second" data-testid="scope-spectrum">
          {finest === undefined ? words.spectrumNone : words.spectrumOf(words.hz(number(finest, 2)))}
        </span>
        {found.map(({ curve, peak }) => (
          <b key={curve.letter} class="small" data-testid={`scope-peak-${curve.letter}`}>
            {peak && peak.amplitude >= 10 ** -curve.decimals / 2
              ? words.peak(
                  curve.letter,
                  words.hz(number(peak.hz, 1)),
                  withUnit(number(peak.amplitude, curve.decimals + 1), unit),
                )
              : words.noPeak(curve.letter)}
          </b>
        ))}
      </header>
      {found.length > 0 && <Drawing found={found} unit={unit} />}
    </section>
  );
}

interface DrawingProps {
  found: readonly { curve: ScopeCurve; spectrum: { t: Float64Array; v: Float64Array } }[];
  unit: string;
}

function Drawing({ found, unit }: DrawingProps) {
  const box = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  useEffect(() => {
    if (!box.current) return undefined;
    const made = new Plot(box.current, {
      x: (v, step) => words.hz(number(v, step < 1 ? 1 : 0)),
      y: (v, step) => withUnit(number(v, step < 0.01 ? 3 : step < 0.1 ? 2 : step < 1 ? 1 : 0), unit),
      ruled: true,
    });
    plot.current = made;
    return () => made.destroy();
  }, [unit]);
  useEffect(() => {
    plot.current?.show({
      curves: found.map(({ curve, spectrum }) => ({
        samples: still(spectrum),
        colour: curve.colour,
        plain: true,
        filled: true,
      })),
      from: 0,
      to: Math.max(1, ...found.map(one => one.spectrum.t.at(-1) ?? 1)),
      range: (drawn, before) => [0, roomy(0.1)(drawn, before)[1]],
    });
  }, [found, unit]);
  return <div ref={box} class="scope-spectrum-plot" role="img" aria-label={words.spectrum} />;
}
