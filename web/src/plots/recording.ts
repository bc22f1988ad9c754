/** Derived data of a recording: timeline, channels worth a plot, file names. */
import type { RecordingColumns, RecordingContent, RecordingMark } from "../api/lab-types";
import { markText } from "../bench/event-text";

export interface RecordingTimeline {
  /** Seconds since 1970 UTC of the first mark, which is 0 on every axis. */
  zero: number;
  from: number;
  to: number;
}

type Times = Pick<RecordingContent["about"], "started_at" | "ended_at"> & {
  marks: readonly { at: number }[];
};

export function timelineOf(about: Times): RecordingTimeline {
  const zero = about.marks[0]?.at ?? about.started_at;
  return { zero, from: about.started_at - zero, to: Math.max(about.ended_at, about.started_at + 1) - zero };
}

/** Ticks of the timeline at whole seconds, in steps that leave space for their labels. */
export function timelineTicksOf(line: RecordingTimeline, most: number): number[] {
  const step =
    [1, 2, 5, 10, 20, 30, 60, 120, 300, 600].find(one => (line.to - line.from) / one <= most) ?? 600;
  const ticks: number[] = [];
  for (let at = Math.ceil(line.from / step) * step; at <= line.to; at += step) ticks.push(at === 0 ? 0 : at);
  return ticks;
}

/** Channels drawn by default, in this order; angle and command share a plot. */
export const USUAL = [
  "current_angle",
  "current_torque",
  "current_voltage",
  "current_temperature",
  "current_speed",
];

const TOGETHER: Readonly<Record<string, string>> = {
  command_angle: "current_angle",
  command_speed: "current_speed",
  command_torque: "current_torque",
};

export interface RecordingPanel {
  key: string;
  measured: RecordingColumns | null;
  command: RecordingColumns | null;
}

/** Number of values: a command that is never sent has gaps only. */
function valueCount(column: RecordingColumns | null): number {
  return column?.v.filter(value => value !== null).length ?? 0;
}

/** One panel per channel with more than one sample, the default channels first. */
export function panelsOf(telemetry: readonly RecordingColumns[], uid: string): RecordingPanel[] {
  const panels = new Map<string, RecordingPanel>();
  for (const column of telemetry) {
    if (column.uid !== uid) continue;
    const key = TOGETHER[column.channel] ?? column.channel;
    const panel = panels.get(key) ?? { key, measured: null, command: null };
    if (key === column.channel) panel.measured = column;
    else panel.command = column;
    panels.set(key, panel);
  }
  const rank = (key: string) => {
    const at = USUAL.indexOf(key);
    return at < 0 ? USUAL.length : at;
  };
  return [...panels.values()]
    .filter(one => valueCount(one.measured) > 1 || valueCount(one.command) > 1)
    .sort((a, b) => rank(a.key) - rank(b.key));
}

/** Further reasons a recording was marked for, each once. */
export function alsoMarked(one: { text: string; marks: readonly RecordingMark[] }): string[] {
  const others = one.marks.filter(mark => mark.text !== one.text);
  return [...new Set(others.map(markText))];
}

export function isZip(name: string): boolean {
  return /\.zip$/i.test(name);
}

/** The servo of the first mark that names one, else the first with telemetry, else the first. */
export function firstServo(content: RecordingContent): string | null {
  const known = new Set(content.about.servos.map(one => one.uid));
  const marked = content.about.marks.find(mark => mark.uid != null && known.has(mark.uid));
  return marked?.uid ?? content.telemetry[0]?.uid ?? content.about.servos[0]?.uid ?? null;
}
