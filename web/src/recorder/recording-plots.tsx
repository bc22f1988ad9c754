/** The plots of an open recording: channels of the selected servo over time relative to the first mark. */
import { effect, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { RecordingContent } from "../api/lab-types";
import { decimalsOf, number, withUnit } from "../bench/format";
import { Choice, cell, Tick } from "../kit/field";
import { Plot, roomy } from "../plots/plot";
import { panelsOf, type RecordingPanel, type RecordingTimeline, USUAL } from "../plots/recording";
import type { Scrub } from "../plots/scrub";
import { ScrubBar } from "../plots/scrub-bar";
import type { PlotCurve } from "../plots/series";
import { samples, still } from "../plots/trace";
import { ReplayView } from "../view3d/replay";
import { channelLabelOf, relative, rowOf } from "./recording-text";
import { recorder as words } from "./words";

const strings = words.recording;
/** Number of channels drawn by default. */
const DRAWN = 4;

interface ChannelsProps {
  content: RecordingContent;
  line: RecordingTimeline;
  uid: string;
  title: string;
  scrub: Scrub;
}

export function Channels({ content, line, uid, title, scrub }: ChannelsProps) {
  const panels = useMemo(() => panelsOf(content.telemetry, uid), [content, uid]);
  // For another servo the default channels are drawn again; its 3D view does not change.
  const picked = useSignal<{ uid: string; keys: ReadonlySet<string> } | null>(null);
  const chosen = picked.value?.uid === uid ? picked.value.keys : usualOf(panels);
  const toggle = (key: string) => {
    const keys = new Set(chosen);
    if (!keys.delete(key)) keys.add(key);
    picked.value = { uid, keys };
  };
  // Every row that was read is a channel; after the Parameters page was open, that is all of them.
  const rest = panels.filter(panel => !isUsual(panel));
  const pick = (panel: RecordingPanel) => (
    <Tick
      key={panel.key}
      label={channelLabelOf(panel.key)}
      at={cell(chosen.has(panel.key), () => toggle(panel.key))}
      testid={`channel-${panel.key}`}
    />
  );
  return (
    <section class="rec-channels" aria-label={strings.channels}>
      <div class="list-bar">
        <Choice
          label={strings.servo}
          testid="recording-servo"
          at={scrub.front}
          beside
          options={content.about.servos.map(one => ({ key: one.uid, label: one.title }))}
        />
        <div class="rec-picks" role="group" aria-label={strings.channels}>
          {panels.filter(isUsual).map(pick)}
          {rest.length > 0 && (
            <details class="rec-more" open={rest.length === panels.length} data-testid="recording-more">
              <summary>{strings.moreChannels(rest.length)}</summary>
              <div class="rec-picks">{rest.map(pick)}</div>
            </details>
          )}
        </div>
      </div>
      <div class="rec-split">
        <div class="rec-plots">
          <p class="w-line second small">
            {panels.length === 0 ? strings.noTelemetry : strings.channelsLine}
          </p>
          {panels
            .filter(panel => chosen.has(panel.key))
            .map(panel => (
              <ChannelPlot key={`${uid}/${panel.key}`} {...{ panel, content, line, title, scrub }} />
            ))}
        </div>
        <ReplayView scrub={scrub} />
      </div>
      <ScrubBar scrub={scrub} />
    </section>
  );
}

const isUsual = (panel: RecordingPanel) => USUAL.includes(panel.key);

function usualOf(panels: readonly RecordingPanel[]): Set<string> {
  const usual = panels.filter(isUsual).map(one => one.key);
  return new Set(usual.slice(0, DRAWN));
}

interface PlotProps {
  panel: RecordingPanel;
  content: RecordingContent;
  line: RecordingTimeline;
  title: string;
  scrub: Scrub;
}

function ChannelPlot({ panel, content, line, title, scrub }: PlotProps) {
  const box = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLSpanElement>(null);
  const row = rowOf(panel.key);
  const unit = row?.unit ?? "";
  const decimals = row ? decimalsOf(row.per_unit) : 2;
  useEffect(() => {
    if (!box.current) return undefined;
    const plot = new Plot(box.current, {
      readout: readout.current,
      group: "recording",
      x: (value, step) => relative(value, step % 1 === 0 ? 0 : step < 0.1 ? 2 : 1),
      y: (value, step) => withUnit(number(value, step < 0.1 ? 2 : step < 1 ? 1 : 0), unit),
      read: (time, values) =>
        strings.at(
          relative(time, 2),
          values.map(one => strings.one(one.name, withUnit(number(one.value, decimals), unit))).join(", "),
        ),
    });
    const curves: PlotCurve[] = [];
    if (panel.command) {
      curves.push({
        samples: still(samples(panel.command.t, panel.command.v, line.zero)),
        colour: "intent",
        wraps: unit === "°",
        dashed: true,
        held: true,
        name: strings.command,
      });
    }
    if (panel.measured) {
      curves.push({
        samples: still(samples(panel.measured.t, panel.measured.v, line.zero)),
        colour: "ink",
        wraps: unit === "°",
        // A written value holds until the next one; a measured value is interpolated.
        held: !panel.key.startsWith("current_"),
        name: panel.key === "current_angle" ? strings.current : channelLabelOf(panel.key),
      });
    }
    const marks = content.about.marks
      .slice(0, 40)
      .map((mark, place) => ({ t: mark.at - line.zero, word: String(place + 1) }));
    plot.show({
      curves,
      marks: () => marks,
      from: line.from,
      to: line.to,
      range: roomy((row?.per_unit ?? 1) >= 10 ? 2 : 10),
    });
    const follow = effect(() => plot.head(scrub.at.value));
    return () => {
      follow();
      plot.destroy();
    };
  }, [panel, content, line, unit, decimals, scrub]);
  const label = panel.key === "current_angle" && panel.command ? strings.angle : channelLabelOf(panel.key);
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
        aria-label={strings.plot(label, title)}
      />
    </figure>
  );
}
