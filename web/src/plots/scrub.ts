/** Playback of an open recording: its servos, the moment shown, their state at it, and moving in time. */
import { computed, type Signal, signal } from "@preact/signals";
import type { RecordingContent } from "../api/lab-types";
import type { ViewPose } from "../bench/view-link";
import { stepFrom } from "./reading";
import type { RecordingTimeline } from "./recording";
import { isGap, NEVER_GAP_S } from "./series";
import { firstAt, type Samples, samples } from "./trace";

/** Rows of a pose, as named in a recording. */
const ROWS = ["current_angle", "command_angle", "angle_limit_cw", "angle_limit_ccw"] as const;
type PoseRow = (typeof ROWS)[number];

/** Model numbers in 0x50, section 4.40. */
const SERIES: Readonly<Record<number, ViewPose["series"]>> = { 61: "BLA21", 62: "BLA15", 86: "BLA34" };

export function seriesOf(modelNumber: number | null | undefined): ViewPose["series"] {
  return SERIES[modelNumber ?? 0] ?? "";
}

/** One servo of a recording. Times are relative to the zero of its axis. */
export interface Track {
  uid: string;
  name: string;
  /** Empty if the recording does not contain it. */
  series: ViewPose["series"];
  rows: Readonly<Record<PoseRow, Samples>>;
}

const NOTHING: Samples = { t: new Float64Array(0), v: new Float64Array(0) };

export function trackOf(
  uid: string,
  name: string,
  series: ViewPose["series"],
  find: (row: PoseRow) => Samples | undefined,
): Track {
  const rows = Object.fromEntries(ROWS.map(row => [row, find(row) ?? NOTHING]));
  return { uid, name, series, rows: rows as Track["rows"] };
}

export interface HeldSample {
  value: number;
  /** No sample for longer than a line would be drawn across. */
  stale: boolean;
}

/** The last value sampled up to a time, never interpolated; null before the first. */
export function heldAt(one: Samples, at: number): HeldSample | null {
  const after = firstAt(one.t, at);
  let last = one.t[after] === at ? after : after - 1;
  let stale = last >= 0 && silent(one.t, last, at);
  for (; last >= 0; last--) {
    const value = one.v[last] ?? Number.NaN;
    if (!Number.isNaN(value)) return { value, stale };
    stale = true;
  }
  return null;
}

/** Whether `at` is in a gap after a sample, or too long after the last one. */
function silent(t: Float64Array, last: number, at: number): boolean {
  const since = at - (t[last] ?? 0);
  if (since <= NEVER_GAP_S) return false;
  if (last + 1 < t.length) return isGap(t, last + 1);
  const usual = last > 0 ? (t[last] ?? 0) - (t[last - 1] ?? 0) : 0;
  return since > 3 * usual;
}

/** A servo at a time: without an angle before its first one, stale in a gap. */
export function poseAt(track: Track, at: number): ViewPose {
  const angle = heldAt(track.rows.current_angle, at);
  const value = (row: PoseRow) => heldAt(track.rows[row], at)?.value ?? null;
  return {
    uid: track.uid,
    series: track.series,
    angle: angle?.value ?? null,
    command: value("command_angle"),
    limit_cw: value("angle_limit_cw"),
    limit_ccw: value("angle_limit_ccw"),
    stale: angle?.stale ?? true,
  };
}

export const SPEEDS = [0.25, 0.5, 1, 2, 4] as const;
/** Longest step of playback: a hidden tab resumes where it was. */
const MOST_STEP_S = 1;

export interface Extent {
  from: number;
  to: number;
  /** Initial moment. */
  start: number;
  /** Zero of the displayed times. */
  origin: number;
  /** Offset of its times to seconds since 1970 UTC; NaN if the recording does not contain it. */
  utc: number;
}

/** Position in a recording. It cannot reach a servo: it has no access to the bus. */
export class Scrub {
  readonly tracks: readonly Track[];
  readonly extent: Extent;
  #usual: Samples;
  readonly at: Signal<number>;
  /** The selected servo. */
  readonly front: Signal<string>;
  readonly playing = signal(false);
  readonly speed = signal<number>(1);
  readonly poses = computed<readonly ViewPose[]>(() => this.tracks.map(one => poseAt(one, this.at.value)));

  /** `usual`: the default sample times, for a recording without angles. */
  constructor(tracks: readonly Track[], extent: Extent, front: string | null = null, usual = NOTHING) {
    this.tracks = tracks;
    this.#usual = usual;
    this.extent = extent;
    this.at = signal(Math.min(extent.to, Math.max(extent.from, extent.start)));
    this.front = signal(front ?? tracks[0]?.uid ?? "");
  }

  get track(): Track | undefined {
    return this.tracks.find(one => one.uid === this.front.value) ?? this.tracks[0];
  }

  /** Move to a moment, limited to the ends. */
  seek(at: number): void {
    if (Number.isFinite(at)) this.at.value = Math.min(this.extent.to, Math.max(this.extent.from, at));
  }

  /** Move to the sample of the selected servo a number of places after this moment, or before it. */
  step(places: number): void {
    const angle = this.track?.rows.current_angle ?? this.#usual;
    const at = this.at.peek();
    const before = firstAt(angle.t, at);
    // Between two samples, the next and the previous one are the nearest.
    const on = angle.t[before] === at;
    if (on) this.seek(stepFrom(angle, at, places));
    else this.seek(angle.t[places > 0 ? before + places - 1 : before + places] ?? at);
  }

  /** At the end, playback restarts from the beginning. */
  play(): void {
    if (this.at.peek() >= this.extent.to) this.seek(this.extent.from);
    this.playing.value = true;
  }

  pause(): void {
    this.playing.value = false;
  }

  /** Advance by a number of seconds. */
  pass(seconds: number): void {
    if (!this.playing.peek()) return;
    this.seek(this.at.peek() + Math.min(MOST_STEP_S, Math.max(0, seconds)) * this.speed.peek());
    if (this.at.peek() >= this.extent.to) this.pause();
  }
}

/** Maximum number of servos sent to a frame; a bus has room for 127. */
const MOST = 256;

/** Every servo of a recording, from its channels. A limit read before the recording starts applies from its start. */
export function scrubOf(content: RecordingContent, line: RecordingTimeline, front: string | null): Scrub {
  const { servos } = content.about;
  const tracks = servos.slice(0, MOST).map(one =>
    trackOf(one.uid, one.title, seriesOf(one.model_number), row => {
      const found = content.telemetry.find(each => each.uid === one.uid && each.channel === row);
      const series = found ? samples(found.t, found.v, line.zero) : NOTHING;
      const known = one.readings[row];
      if (series.t.length > 0 || !row.startsWith("angle_limit") || typeof known?.value !== "number")
        return series;
      if (known.at === null || known.at - line.zero > line.from) return series;
      return { t: Float64Array.of(line.from), v: Float64Array.of(known.value) };
    }),
  );
  return new Scrub(tracks, { from: line.from, to: line.to, start: 0, origin: 0, utc: line.zero }, front);
}

/** Columns of a telemetry.csv as tracks: servos by the names at the start of the columns; angles only, else null. */
export function tracksOf(columns: readonly { head: string; t: Float64Array; v: Float64Array }[]): Track[] {
  const named = new Map<string, Map<string, Samples>>();
  for (const one of columns) {
    const cut = one.head.lastIndexOf("/");
    const whose = cut < 0 ? "" : one.head.slice(0, cut);
    const rows = named.get(whose) ?? new Map<string, Samples>();
    rows.set(one.head.slice(cut + 1), one);
    named.set(whose, rows);
  }
  return [...named]
    .filter(([, rows]) => rows.has("current_angle"))
    .slice(0, MOST)
    .map(([name, rows], place) =>
      // A file with plain columns names no servo: they belong to this one.
      trackOf(place.toString(16).padStart(32, "0"), name, seriesOf(rows.get("model_number")?.v[0]), row =>
        rows.get(row),
      ),
    );
}

/** The recording that the 3D view shows instead of its servo; null: the servo. */
export const replayed = signal<Scrub | null>(null);
