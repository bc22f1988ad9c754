/** Progress and result of a change: steps of its job with evidence, or the result of each servo. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Job } from "../api/types";
import { now } from "../bench/clock";
import { failureText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { ended, jobs } from "../bench/jobs";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import type { ChangeFlow, ChangeKind, Turn } from "./flow";
import { JobSteps } from "./job-steps";
import { restoredBy } from "./restoring";
import { changing as strings } from "./words";

export function Progress({ flow }: { flow: ChangeFlow }) {
  const turns = flow.turns.value;
  const { kind } = flow.request;
  const [only] = turns;
  return (
    <div
      class="turns"
      role="status"
      aria-label={strings.results}
      data-testid="change-progress"
      data-state={flow.phase.value !== "over" ? "running" : flow.well ? "done" : "failed"}
    >
      {turns.length === 1 && only?.job ? (
        <>
          <Why turn={only} />
          <Steps turn={only} kind={kind} scale />
        </>
      ) : (
        turns.map(turn => <One key={turn.uid} turn={turn} kind={kind} />)
      )}
    </div>
  );
}

function One({ turn: reported, kind }: { turn: Turn; kind: ChangeKind }) {
  const job = reported.job === null ? undefined : jobs.value.get(reported.job);
  const steps = job && stepsOf(job, reported.uid).length > 0;
  // If one job handles several servos, its steps show the current one.
  const turn: Turn =
    reported.state === "waiting" && job && stepsOf(job, reported.uid).some(step => step.state !== "waiting")
      ? { ...reported, state: "running" }
      : reported;
  const head = (
    <>
      <Mark turn={turn} /> <b>{nameOf(servo(turn.uid))}</b> <span class="second">{outcome(turn)}</span>
    </>
  );
  const facts = { "data-testid": `turn-${turn.uid}`, "data-state": turn.state };
  if (!steps) {
    return (
      <div class="turn" {...facts}>
        <p>{head}</p>
      </div>
    );
  }
  return (
    <details class="turn" open={turn.state === "running" || turn.state === "failed"} {...facts}>
      <summary>{head}</summary>
      <Steps turn={turn} kind={kind} />
    </details>
  );
}

/** Result of a servo, in one line. */
function outcome(turn: Turn): string {
  if (turn.fault !== null) return strings.fault[turn.fault](turn.why ?? "");
  if (turn.why !== null) return turn.why;
  if (turn.state !== "done") return strings.state[turn.state];
  if (turn.count === 0) return turn.saved ? strings.saved : strings.state.done;
  return turn.saved ? strings.writtenSaved(turn.count) : strings.written(turn.count);
}

function Why({ turn }: { turn: Turn }) {
  if (turn.state !== "failed" && turn.state !== "left_out") return null;
  const why = outcome(turn);
  if (why === strings.state[turn.state]) return null;
  return <Note testid="change-why">{why}</Note>;
}

function Steps({ turn, kind, scale = false }: { turn: Turn; kind: ChangeKind; scale?: boolean }) {
  const job = turn.job === null ? undefined : jobs.value.get(turn.job);
  if (!job) return null;
  const over = ended(job);
  return (
    <>
      {scale && kind !== "output" && job.kind !== "plan" && <TimeScale job={job} over={over} />}
      <JobSteps
        kind={job.kind}
        uid={job.uid}
        steps={kind === "output" ? heldSteps(job) : stepsOf(job, turn.uid)}
        bare={job.uid === null && turn.uid !== ""}
        label={strings.steps(nameOf(servo(turn.uid || job.uid)))}
        over={over}
        {...(kind === "output"
          ? { name: step => (step.uid ? nameOf(servo(step.uid)) : strings.output.cleared) }
          : {})}
      />
      {kind === "output" && job.error && <Note>{failureText(job.error)}</Note>}
    </>
  );
}

/** The steps of a servo, also within a job of several. */
const stepsOf = (job: Job, uid: string) =>
  job.uid === null && uid !== "" ? job.steps.filter(step => step.uid === uid) : job.steps;

/** Steps of restoring outputs, with the angle each servo holds; a failed one with its reason. */
function heldSteps(job: Job): Job["steps"] {
  const parts = restoredBy(job);
  return job.steps.map(step => {
    const at = parts.find(one => one.uid === step.uid)?.angle_deg;
    const held = step.state === "done" && at != null ? strings.output.held(angle(at)) : null;
    return step.state === "failed" ? step : { ...step, evidence: held, evidence_code: null };
  });
}

function Mark({ turn }: { turn: Turn }) {
  switch (turn.state) {
    case "running":
      return (
        <span class="k-intent">
          <Spinner />
        </span>
      );
    case "done":
      return (
        <span class="k-ok">
          <Icon name="tick" size={16} />
        </span>
      );
    case "waiting":
      return <span class="ring" aria-hidden="true" />;
    default:
      return <Glyph kind="failure" />;
  }
}

/** Usual duration of a save; the scale grows beyond it. */
const USUAL_S = 3;
const WIDTH = 630;

/** Times of a job are the server's; while it runs, the elapsed time is that of our clock since the dialog saw it. */
function useElapsed(job: Job, over: boolean): number {
  const began = useSignal(now.peek());
  useEffect(() => {
    began.value = now.peek();
  }, [job.id]);
  if (over && job.ended_at !== null) return Math.max(0, job.ended_at - job.created_at);
  return Math.max(0, now.value - began.value);
}

/** After the job has ended, the scale ends with it. */
function TimeScale({ job, over }: { job: Job; over: boolean }) {
  const elapsed = useElapsed(job, over);
  const whole = over ? Math.max(elapsed, 0.1) : Math.max(USUAL_S, Math.ceil(elapsed));
  const minor = whole > 10 ? 1 : 10;
  const x = (s: number) => (s * WIDTH) / whole;
  let path = `M0 9H${WIDTH}`;
  for (let i = 0; i <= whole * minor; i++) path += `M${x(i / minor)} ${i % minor === 0 ? 0 : 5}V9`;
  const every = Math.max(1, Math.ceil(whole / 6));
  const seconds = Array.from({ length: Math.floor(whole / every) + 1 }, (_, i) => i * every);
  // Omit a mark that would overlap the last one.
  const marks = over ? [...seconds.filter(mark => x(mark) < WIDTH - 56), whole] : seconds;
  return (
    <svg
      class="time-scale"
      data-testid="time-scale"
      width="100%"
      viewBox={`-2 -1 ${WIDTH + 4} 32`}
      aria-hidden="true"
    >
      <path d={path} stroke="var(--edge)" fill="none" />
      <path
        data-testid="time-bar"
        d={`M0 12H${x(over ? whole : Math.min(elapsed, whole))}`}
        stroke="var(--ink)"
        stroke-width="4"
      />
      {marks.map(mark => (
        <text
          key={mark}
          x={x(mark)}
          y="28"
          text-anchor={mark === 0 ? "start" : mark === whole ? "end" : "middle"}
          font-size="12"
          fill="var(--ink-2)"
        >
          {withUnit(number(mark, Number.isInteger(mark) ? 0 : 1), "s")}
        </text>
      ))}
    </svg>
  );
}
