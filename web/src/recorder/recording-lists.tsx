/** The lists of an open recording: events and writes. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { RecordingContent } from "../api/lab-types";
import type { BenchEvent } from "../bench/bench";
import { eventText } from "../bench/event-text";
import { full, MINUS } from "../bench/format";
import { DataTable } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import type { RecordingTimeline } from "../plots/recording";
import { channelLabelOf, relative, rowOf } from "./recording-text";
import { recorder as words } from "./words";

const strings = words.recording;
const SHOWN = 200;

interface ListProps {
  content: RecordingContent;
  line: RecordingTimeline;
  title: (uid: string | null | undefined) => string;
}

const LEVELS: Readonly<Record<string, "failure" | "warning" | "notice" | "ok">> = {
  failure: "failure",
  error: "failure",
  warning: "warning",
  notice: "notice",
  info: "ok",
};

export function Events({ content, line, title }: ListProps) {
  const most = useSignal(SHOWN);
  const head = strings.eventHead;
  return (
    <details class="rec-list" open data-testid="recording-events">
      <summary>{strings.events(content.events.length)}</summary>
      <DataTable
        empty={<p class="w-line second">{strings.noEvents}</p>}
        label={strings.events(content.events.length)}
        rows={content.events.slice(0, most.value)}
        id={one => content.events.indexOf(one)}
        columns={[
          {
            key: "time",
            head: head.time,
            cell: one => typeof one.time === "number" && relative(one.time - line.zero, 2),
          },
          {
            key: "what",
            head: head.what,
            cell: one => (
              <span class="rec-what">
                <Glyph kind={LEVELS[String(one.level)] ?? "ok"} size={14} />
                <span>{whatText(one)}</span>
              </span>
            ),
          },
          {
            key: "servo",
            head: head.servo,
            cell: one => title(typeof one.uid === "string" ? one.uid : null),
          },
        ]}
      />
      <More total={content.events.length} most={most} />
    </details>
  );
}

export function Writes({ content, line, title }: ListProps) {
  const most = useSignal(SHOWN);
  const head = strings.writeHead;
  return (
    <details class="rec-list" data-testid="recording-writes">
      <summary>{strings.writes(content.writes.length)}</summary>
      <DataTable
        empty={<p class="w-line second">{strings.noWrites}</p>}
        label={strings.writes(content.writes.length)}
        rows={content.writes.slice(0, most.value)}
        id={one => content.writes.indexOf(one)}
        columns={[
          { key: "time", head: head.time, cell: one => relative(Number(one.time) - line.zero, 2) },
          { key: "servo", head: head.servo, cell: one => (one.uid ? title(one.uid) : one.name) },
          { key: "what", head: head.what, cell: written },
          { key: "value", head: head.value, right: true, cell: shownValue },
        ]}
      />
      <More total={content.writes.length} most={most} />
    </details>
  );
}

function written(one: Record<string, string>): ComponentChildren {
  if (one.kind === "parameter") {
    return (
      <>
        {one.key ? channelLabelOf(one.key) : one.name} {one.key && <small>{one.name}</small>}
      </>
    );
  }
  return strings.kind[one.kind ?? ""] || `${one.kind} ${one.key}`.trim();
}

function shownValue(one: Record<string, string>): string {
  const value = Number(one.value);
  const row = one.key ? rowOf(one.key) : undefined;
  if (!one.value || Number.isNaN(value)) return one.value || (one.raw ?? "");
  if (!row) return one.value.replace("-", MINUS);
  if (row.kind === "number") return full(value, { ...row, perUnit: row.per_unit });
  return row.choices.find(each => each.raw === value)?.label ?? one.value;
}

function More({ total, most }: { total: number; most: { value: number } }) {
  if (total <= most.value) return null;
  return (
    <p class="w-line">
      <button
        type="button"
        class="link"
        onClick={() => {
          most.value += 5 * SHOWN;
        }}
      >
        {strings.more(Math.min(5 * SHOWN, total - most.value))}
      </button>
    </p>
  );
}

/** Text of an event of a recording, which may be of another version: an event, or a change with a type. */
function whatText(one: Readonly<Record<string, unknown>>): string {
  const { code, text, params, type } = one as Partial<BenchEvent> & { type?: string };
  if (code === undefined || text === undefined) return String(text ?? code ?? type ?? "");
  return eventText({ code, text, ...(params && { params }) });
}
