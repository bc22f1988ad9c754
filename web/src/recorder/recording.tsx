/** An open recording: facts, marks on a timeline, plots, events and writes. Needs no bus. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useMemo } from "preact/hooks";
import { API, callApi } from "../api/client";
import type { RecordingContent } from "../api/lab-types";
import { channelOf } from "../bench/bus-now";
import { markText } from "../bench/event-text";
import { clock, grouped, number, withUnit } from "../bench/format";
import { Resource } from "../bench/resource";
import { go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { instant } from "../kit/loaded";
import { Note } from "../kit/note";
import { Loaded } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { firstServo, type RecordingTimeline, timelineOf, timelineTicksOf } from "../plots/recording";
import { scrubOf } from "../plots/scrub";
import { PlayDialog } from "./play";
import { GLYPHS } from "./recording-glyph";
import { Events, Writes } from "./recording-lists";
import { Channels } from "./recording-plots";
import { relative } from "./recording-text";
import { recorder as words } from "./words";

const strings = words.recording;
const READ_MS = 120_000;

/** An open recording; `at`, seconds since 1970 UTC, is the initial moment. */
export function RecordingView({ name, at }: { name: string; at: number | null }) {
  const content = useMemo(
    () =>
      new Resource(() =>
        callApi("GET", "/recorder/recordings/{name}/content", { path: { name }, timeout_ms: READ_MS }),
      ),
    [name],
  );
  const playing = useSignal(false);
  useEffect(() => void content.load(), [content]);
  const found = content.value.value;
  return (
    <>
      <div class="list-bar">
        <Button testid="recordings-back" onClick={() => go(pathOf("recorder", null))}>
          {strings.back}
        </Button>
        <h1 class="grow rec-name">{name}</h1>
        <a class="button" href={`${API}/recorder/recordings/${encodeURIComponent(name)}`} download="">
          <Icon name="download" size={15} /> {words.download}
        </a>
        <Button
          live
          testid="recording-play"
          disabled={found === null}
          onClick={() => {
            playing.value = true;
          }}
        >
          <Icon name="play" size={15} /> {words.play}
        </Button>
      </div>
      <Scroll label={name} testid="recording">
        <Loaded of={content} />
        {found === null && content.problem.value === null && <p class="w-line second">{strings.loading}</p>}
        {found && <Content content={found} at={at} />}
      </Scroll>
      {playing.value && (
        <PlayDialog
          name={name}
          onClose={() => {
            playing.value = false;
          }}
        />
      )}
    </>
  );
}

function Content({ content, at }: { content: RecordingContent; at: number | null }) {
  const about = content.about;
  const line = useMemo(() => timelineOf(about), [about]);
  const scrub = useMemo(() => {
    const made = scrubOf(content, line, firstServo(content));
    if (at !== null) made.seek(at - line.zero);
    return made;
  }, [content, line]);
  const title = (uid: string | null | undefined) =>
    uid ? (about.servos.find(one => one.uid === uid)?.title ?? uid.slice(0, 8)) : strings.all;
  const uid = scrub.front.value;
  return (
    <>
      <section class="rec-about" aria-label={strings.title(words.why[about.reason] ?? about.reason)}>
        <p class="rec-why" data-testid="recording-why">
          <Glyph kind={GLYPHS[about.reason] ?? "ok"} />
          <span>
            <b>{words.why[about.reason] ?? about.reason}</b>: {markText(about.marks[0] ?? about)}
          </span>
        </p>
        <dl class="rec-facts">
          <Fact name={strings.facts.span}>
            {instant(about.started_at)} – {clock(about.ended_at)},{" "}
            {withUnit(number(about.ended_at - about.started_at, 0), "s")}
          </Fact>
          <Fact name={strings.facts.bus}>
            {about.bus
              ? strings.bus(
                  channelOf(about.bus.address),
                  withUnit(number(about.bus.bitrate / 1e6, 0), "Mbit/s"),
                )
              : strings.noBus}
          </Fact>
          <Fact name={strings.facts.servos}>{about.servos.length}</Fact>
          <Fact name={strings.facts.frames}>{grouped(about.frames)}</Fact>
          <Fact name={strings.facts.version}>{strings.hornbill(about.version)}</Fact>
        </dl>
        {about.incomplete.length > 0 && <Warn line={strings.cut(about.incomplete.join(", "))} />}
        {!content.complete && <Warn line={strings.incomplete} />}
        <TimeLine line={line} content={content} />
        <ol class="rec-marks" aria-label={strings.marks} data-testid="recording-marks">
          {about.marks.map((mark, place) => (
            <li key={`${mark.at}-${place}`}>
              <b class="rec-number">{place + 1}</b>
              <span class="rec-time">{relative(mark.at - line.zero, 1)}</span>
              <Glyph kind={GLYPHS[mark.reason] ?? "ok"} size={14} />
              <span>
                {words.why[mark.reason] ?? mark.reason}: {markText(mark)}
                {mark.uid != null && !mark.text.includes(title(mark.uid)) && (
                  <span class="second"> {title(mark.uid)}</span>
                )}
              </span>
            </li>
          ))}
        </ol>
      </section>
      {uid !== "" && <Channels content={content} line={line} uid={uid} title={title(uid)} scrub={scrub} />}
      <Events content={content} line={line} title={title} />
      <Writes content={content} line={line} title={title} />
    </>
  );
}

function Fact({ name, children }: { name: string; children: ComponentChildren }) {
  return (
    <div>
      <dt class="second">{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

function Warn({ line }: { line: string }) {
  return (
    <Note kind="warning" band>
      {line}
    </Note>
  );
}

const WIDTH = 1000;

/** A scale with the marks on it; events are small ticks above. */
function TimeLine({ line, content }: { line: RecordingTimeline; content: RecordingContent }) {
  const x = (at: number) => ((at - line.from) / (line.to - line.from)) * WIDTH;
  const percent = (at: number) => `${((at - line.from) / (line.to - line.from)) * 100}%`;
  const ticks = timelineTicksOf(line, 12);
  const fine = timelineTicksOf(line, 60);
  const marks = content.about.marks;
  const events = content.events.flatMap(one => (typeof one.time === "number" ? one.time - line.zero : []));
  const label = strings.line(marks.length, relative(line.from, 0), relative(line.to, 0));
  return (
    <div class="rec-line-scale" role="img" aria-label={label}>
      <svg width="100%" height="34" viewBox={`0 0 ${WIDTH} 34`} preserveAspectRatio="none" aria-hidden="true">
        <path
          d={events.map(at => `M${x(at)} 4V12`).join("")}
          stroke="var(--ink-2)"
          vector-effect="non-scaling-stroke"
        />
        <path
          d={`M0 33H${WIDTH}${ticks.map(at => `M${x(at)} 20V33`).join("")}${fine.map(at => `M${x(at)} 27V33`).join("")}`}
          stroke="var(--edge)"
          fill="none"
          vector-effect="non-scaling-stroke"
        />
        <path
          d={marks.map(mark => `M${x(mark.at - line.zero)} 0V33`).join("")}
          stroke="var(--ink)"
          stroke-width="2"
          vector-effect="non-scaling-stroke"
        />
      </svg>
      <div class="rec-ticks" aria-hidden="true">
        {ticks.map(at => (
          <span key={at} style={{ left: percent(at) }}>
            {relative(at, 0)}
          </span>
        ))}
        {marks.slice(0, 20).map((mark, place) => (
          <b key={`${mark.at}-${place}`} style={{ left: percent(mark.at - line.zero) }}>
            {place + 1}
          </b>
        ))}
      </div>
    </div>
  );
}
