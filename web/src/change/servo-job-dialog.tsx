/** Restarts or a factory reset under way: each servo's steps with their evidence, and how each ended. */
import { useEffect } from "preact/hooks";
import { nameOf, servo } from "../bench/fleet";
import { ended, jobs } from "../bench/jobs";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { text } from "../text";
import { restarting as words } from "../text/topics";
import { JobSteps } from "./job-steps";
import { servoTurns, type Turn, turnsUnderWay, type Verb } from "./servo-jobs";
import "../kit/table.css";
import "./restarting.css";

const said = words.run;

export function ServoJobDialog({ onClose }: { onClose: () => void }) {
  const present = servoTurns.value;
  const running = turnsUnderWay();
  // The button that had the focus is gone with the question.
  useEffect(() => {
    document.querySelector<HTMLElement>("[data-testid=servo-job-close]")?.focus();
  }, []);
  if (present === null) return null;
  const { turns: all, verb } = present;
  const done = all.filter(one => one.state === "done").length;
  const only = all.length === 1 ? all[0] : undefined;
  return (
    <Dialog
      title={titleOf(verb, all)}
      subtitle={running ? said.keepOn : undefined}
      testid="servo-job-dialog"
      onClose={onClose}
      foot={
        <>
          <span class="small second">{only ? said.state[only.state] : said.of(done, all.length)}</span>
          <span class="grow" />
          <span data-first-focus>
            <Button testid="servo-job-close" onClick={onClose}>
              {running ? text.job.hide : text.job.close}
            </Button>
          </span>
        </>
      }
    >
      <div class="servo-jobs" role="status" data-state={running ? "running" : "over"}>
        {only ? <Only turn={only} /> : all.map(one => <One key={one.uid} turn={one} />)}
      </div>
    </Dialog>
  );
}

function titleOf(verb: Verb, all: readonly Turn[]): string {
  const bad = all.filter(one => one.state === "failed" || one.state === "left_out").length;
  const which = turnsUnderWay() ? said.title : bad > 0 ? said.failed : said.done;
  const [first] = all;
  if (all.length === 1 && first) return which[verb].one(nameOf(servo(first.uid)));
  return which[verb].all(bad > 0 && !turnsUnderWay() ? bad : all.length);
}

function Only({ turn }: { turn: Turn }) {
  return (
    <>
      <Why turn={turn} />
      <Steps turn={turn} />
    </>
  );
}

function One({ turn }: { turn: Turn }) {
  const name = nameOf(servo(turn.uid));
  const open = turn.state === "running" || turn.state === "failed";
  return (
    <details class="servo-job" open={open} data-testid={`turn-${turn.uid}`} data-state={turn.state}>
      <summary>
        <Mark turn={turn} /> <b>{name}</b> <span class="second">{said.state[turn.state]}</span>
      </summary>
      <Why turn={turn} />
      <Steps turn={turn} />
    </details>
  );
}

function Why({ turn }: { turn: Turn }) {
  if (turn.why === null) return null;
  return (
    <p class="refusal" role="alert" data-testid="servo-job-why">
      <Glyph kind="failure" size={14} /> {turn.why}
    </p>
  );
}

function Steps({ turn }: { turn: Turn }) {
  const job = turn.job === null ? undefined : jobs.value.get(turn.job);
  return job ? (
    <JobSteps
      kind={job.kind}
      steps={job.steps}
      label={said.steps(nameOf(servo(turn.uid)))}
      over={ended(job)}
    />
  ) : null;
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
