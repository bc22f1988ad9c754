/** Owns the plots of an open bundle: channels of a chosen servo over the time from the first mark. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import "uplot/dist/uPlot.min.css";
import type { BundleContent } from "../api/lab-types";
import { decimalsOf, number, withUnit } from "../form/format";
import { samples } from "../plots/trace";
import { type Curve, TracePlot } from "../plots/trace-plot";
import { type Line, type Panel, panelsOf, USUAL } from "../state/bundle";
import { recorder as words } from "../text/topics";
import { labelOf, relative, rowOf } from "./records-bundle-words";
import { Choice } from "./records-parts";

const said = words.bundle;
/** Of this many channels a plot is drawn before anybody chooses. */
const DRAWN = 4;

interface ChannelsProps {
  content: BundleContent;
  line: Line;
  uid: string;
  title: string;
  onServo: (uid: string) => void;
}

export function Channels({ content, line, uid, title, onServo }: ChannelsProps) {
  const panels = useMemo(() => panelsOf(content.telemetry, uid), [content, uid]);
  const drawn = useSignal<ReadonlySet<string>>(
    new Set(
      panels
        .map(one => one.key)
        .filter(key => USUAL.includes(key))
        .slice(0, DRAWN),
    ),
  );
  const toggle = (key: string) => {
    const next = new Set(drawn.peek());
    if (!next.delete(key)) next.add(key);
    drawn.value = next;
  };
  return (
    <section class="rec-channels" aria-label={said.channels}>
      <div class="r-bar">
        <Choice
          label={said.servo}
          testid="bundle-servo"
          value={uid}
          options={content.about.servos.map(one => ({ key: one.uid, label: one.title }))}
          onChoose={onServo}
        />
        <div class="rec-picks" role="group" aria-label={said.channels}>
          {panels.map(panel => (
            <label key={panel.key} class="rec-pick">
              <input
                type="checkbox"
                data-testid={`channel-${panel.key}`}
                checked={drawn.value.has(panel.key)}
                onChange={() => toggle(panel.key)}
              />
              {labelOf(panel.key)}
            </label>
          ))}
        </div>
      </div>
      {panels.length === 0 ? (
        <p class="w-line second">{said.noTelemetry}</p>
      ) : (
        <p class="w-line second small">{said.channelsLine}</p>
      )}
      {panels
        .filter(panel => drawn.value.has(panel.key))
        .map(panel => (
          <ChannelPlot key={panel.key} panel={panel} content={content} line={line} title={title} />
        ))}
    </section>
  );
}

interface PlotProps {
  panel: Panel;
  content: BundleContent;
  line: Line;
  title: string;
}

function ChannelPlot({ panel, content, line, title }: PlotProps) {
  const box = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLSpanElement>(null);
  const row = rowOf(panel.key);
  const unit = row?.unit ?? "";
  const decimals = row ? decimalsOf(row.per_unit) : 2;
  useEffect(() => {
    if (!box.current) return undefined;
    const plot = new TracePlot(
      box.current,
      readout.current,
      {
        x: (value, step) => relative(value, step % 1 === 0 ? 0 : step < 0.1 ? 2 : 1),
        y: (value, step) => withUnit(number(value, step < 0.1 ? 2 : step < 1 ? 1 : 0), unit),
        at: (time, values) =>
          said.at(
            relative(time, 2),
            values.map(one => said.one(one.name, withUnit(number(one.value, decimals), unit))).join(", "),
          ),
      },
      "bundle",
    );
    const curves: Curve[] = [];
    if (panel.command) {
      curves.push({
        samples: samples(panel.command.t, panel.command.v, line.zero),
        colour: "intent",
        dashed: true,
        held: true,
        name: said.command,
      });
    }
    if (panel.measured) {
      curves.push({
        samples: samples(panel.measured.t, panel.measured.v, line.zero),
        colour: "ink",
        // A row keeps what was written; what is measured moves between two samples.
        held: !panel.key.startsWith("current_"),
        name: panel.key === "current_angle" ? said.current : labelOf(panel.key),
      });
    }
    plot.show({
      curves,
      marks: content.about.marks
        .slice(0, 40)
        .map((mark, place) => ({ t: mark.at - line.zero, label: String(place + 1) })),
      from: line.from,
      to: line.to,
      least: (row?.per_unit ?? 1) >= 10 ? 2 : 10,
    });
    return () => plot.destroy();
  }, [panel, content, line, unit, decimals]);
  const label = panel.key === "current_angle" && panel.command ? said.angle : labelOf(panel.key);
  return (
    <figure class="rec-plot">
      <figcaption>
        <b>{label}</b>
        <span class="grow" />
        <span ref={readout} class="second small" aria-hidden="true" />
      </figcaption>
      <div
        ref={box}
        class="record-plot"
        role="img"
        data-testid={`plot-${panel.key}`}
        aria-label={said.plot(label, title)}
      />
    </figure>
  );
}
