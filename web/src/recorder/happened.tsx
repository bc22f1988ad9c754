/** From an event to its recording: stored, being saved, or still in the recorder's memory. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { callApi, problemOf } from "../api/client";
import type { RecorderState, Recording } from "../api/lab-types";
import { problemText } from "../bench/facts";
import { number } from "../bench/format";
import { go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { instant } from "../kit/loaded";
import { Note } from "../kit/note";
import { recorder as words } from "./words";

const strings = words.happened;

/** Time of the event, seconds since 1970 UTC: first and last occurrence. */
export interface Occurrence {
  from: number;
  to: number;
}

/** The moment to open in the newest recording that contains the event: its mark, else its start. */
export function recordingOf(
  { from, to }: Occurrence,
  recordings: readonly Pick<Recording, "name" | "started_at" | "seconds" | "marks">[],
): { name: string; at: number } | null {
  const held = recordings.flatMap(one => {
    if (one.started_at === null || one.seconds === null) return [];
    const end = one.started_at + one.seconds;
    if (end < from || one.started_at > to) return [];
    const mark = one.marks.find(each => each.at >= from - NEAR_S && each.at <= to + NEAR_S);
    return [{ name: one.name, marked: mark !== undefined, at: mark?.at ?? Math.max(from, one.started_at) }];
  });
  const best = held.find(one => one.marked) ?? held[0];
  return best ? { name: best.name, at: best.at } : null;
}

/** A mark is set a little after the event. */
const NEAR_S = 2;
/** A saved recording starts this long before the event. */
const LEAD_S = 30;
/** Maximum reach of the recorder. */
const MOST_S = 600;

interface HappenedProps {
  of: Occurrence;
  recordings: readonly Recording[];
  state: RecorderState;
  onSave: () => void;
}

export function Happened({ of, recordings, state, onSave }: HappenedProps) {
  const busy = useSignal(false);
  const problem = useSignal<string | null>(null);
  const found = recordingOf(of, recordings);
  useEffect(() => {
    if (found) go(pathOf("recorder", null, encodeURIComponent(found.name), { at: String(found.at) }), true);
  }, [found?.name]);
  if (found) return null;
  const ago = Date.now() / 1000 - of.to;
  if (state.pending)
    return (
      <Note kind="notice" band testid="happened">
        {strings.writing(instant(of.to), number(Math.ceil(state.pending.ready_in_s), 0))}
      </Note>
    );
  if (!state.recording || ago > state.reach_s)
    return (
      <Note kind="warning" band testid="happened">
        {strings.gone(instant(of.to))}
      </Note>
    );
  const save = async () => {
    busy.value = true;
    problem.value = null;
    try {
      const before = Math.min(MOST_S, Math.max(1, Math.ceil(ago + LEAD_S)));
      await callApi("POST", "/recorder/recordings", {
        body: { before_s: before },
      });
      onSave();
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
    busy.value = false;
  };
  return (
    <>
      <Note
        kind="notice"
        band
        testid="happened"
        action={
          <Button live testid="happened-save" disabled={busy.value} onClick={() => void save()}>
            {strings.save}
          </Button>
        }
      >
        {strings.held(instant(of.to))}
      </Note>
      <Note>{problem.value}</Note>
    </>
  );
}
