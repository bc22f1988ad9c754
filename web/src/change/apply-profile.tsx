/** Applying a profile to servos: whom, what would change, and the job that does it. */

import { useSignal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Profile, SafetyWord, SavePreview } from "../api/config-types";
import type { Change, Job, LeftOut, ProblemBody } from "../api/types";
import { problemText } from "../bench/facts";
import { all, nameOf, servo } from "../bench/fleet";
import { ended, jobs, setJob, settled } from "../bench/jobs";
import { asProblem } from "../bench/parameters";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { records as words } from "../text/topics";
import { ConfirmTicks } from "./confirm-ticks";
import { whyRefused } from "./consequences";
import { AfterSave, useFreeAfterSave } from "./horn-free";
import { JobSteps } from "./job-steps";
import { wordsOf } from "./safety-words";
import "./change.css";

const said = words.profiles;

/** One servo in the result of a job of kind "profile". */
interface Applied extends SavePreview {
  uid: string;
  outcome: string;
  changes: Change[];
  left_out: LeftOut[];
  saved: boolean;
  problem: (ProblemBody & { confirm?: SafetyWord }) | null;
}

const appliedOf = (job: Job | null): Applied[] =>
  (job?.result as { servos?: Applied[] } | null | undefined)?.servos ?? [];

interface Props {
  one: Profile;
  /** Servos ticked from the start. */
  uids?: readonly string[];
  onClose: () => void;
}

export function ApplyDialog({ one, uids = [], onClose }: Props) {
  const online = all.value.filter(each => each.online && each.model !== null);
  const chosen = useSignal<ReadonlySet<string>>(
    new Set(uids.filter(uid => online.some(each => each.uid === uid))),
  );
  const save = useSignal(false);
  const goOn = useSignal(false);
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const planned = useSignal<Job | null>(null);
  const running = useSignal<string | null>(null);
  const busy = useSignal(false);
  const problem = useSignal<string | null>(null);
  const job = running.value === null ? null : (jobs.value.get(running.value) ?? null);
  const over = job !== null && ended(job);
  const shown = job ?? planned.value;
  const results = appliedOf(shown);
  const needed = [
    ...new Set(results.flatMap(each => (each.problem ? wordsOf(asProblem(each.problem)) : []))),
  ];
  const words_ = [...new Set([...agreed.value, ...needed])];
  const send = async (dry_run: boolean) => {
    busy.value = true;
    problem.value = null;
    running.value = null;
    if (dry_run) planned.value = null;
    try {
      const path = `/profiles/${encodeURIComponent(one.name)}/apply${dry_run ? "?wait=true" : ""}`;
      const answer = await ask<Job>("POST", path, {
        body: {
          uids: [...chosen.peek()],
          dry_run,
          save: save.peek(),
          on_anomaly: dry_run || goOn.peek() ? "continue" : "stop",
          confirm: agreed.peek(),
        },
        timeout_ms: 60_000,
      });
      setJob(answer);
      if (dry_run) planned.value = answer;
      else {
        running.value = answer.id;
        planned.value = null;
        await settled(answer.id);
      }
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
    busy.value = false;
  };
  const n = chosen.value.size;
  const passed = results.filter(each => each.problem === null);
  const able = passed.length;
  const saves = save.value && job === null && planned.value !== null ? passed : [];
  const free = useFreeAfterSave(saves);
  return (
    <Dialog
      title={said.applyTitle(one.name)}
      testid="apply-dialog"
      onClose={onClose}
      foot={
        <>
          {busy.value && (
            <span class="k-intent working">
              <Spinner /> {words.write.working}
            </span>
          )}
          <span class="grow" />
          <span data-first-focus>
            <Button onClick={onClose}>{over ? text.close : text.cancel}</Button>
          </span>
          <Button
            live
            disabled={busy.value || n === 0}
            testid="apply-preview"
            onClick={() => void send(true)}
          >
            {said.preview}
          </Button>
          <Button
            look="primary"
            live
            testid="apply-confirm"
            disabled={
              busy.value || planned.value === null || able === 0 || !free.agreed || (able < n && !goOn.value)
            }
            onClick={() => void send(false)}
          >
            {said.goApply(n)}
          </Button>
        </>
      }
    >
      {online.length === 0 && <p>{said.nobody}</p>}
      <fieldset class="r-who" disabled={busy.value}>
        <legend class="second">{said.applyWho}</legend>
        {online.map(each => (
          <label key={each.uid} class="tick" data-testid={`apply-${each.uid}`}>
            <input
              type="checkbox"
              checked={chosen.value.has(each.uid)}
              onChange={event => {
                const next = new Set(chosen.peek());
                if (event.currentTarget.checked) next.add(each.uid);
                else next.delete(each.uid);
                chosen.value = next;
                planned.value = null;
                running.value = null;
              }}
            />
            <span class="grow">
              {nameOf(each)} <small class="second">{each.model}</small>
            </span>
            <Result one={results.find(found => found.uid === each.uid)} />
          </label>
        ))}
      </fieldset>
      {problem.value !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {problem.value}
        </p>
      )}
      {/* The job's own steps say it too. */}
      {(job === null ? results : [])
        .filter(each => each.problem !== null)
        .map(each => (
          <p key={each.uid} class="refusal" role="alert">
            <Glyph kind="failure" size={14} /> {nameOf(servo(each.uid))}:{" "}
            {each.problem && whyRefused(asProblem(each.problem))}
          </p>
        ))}
      <ConfirmTicks needed={words_} agreed={agreed} sentences={words.write.confirm} />
      {job === null && (
        <>
          <label class="tick">
            <input
              type="checkbox"
              data-testid="apply-save"
              checked={save.value}
              onChange={event => {
                save.value = event.currentTarget.checked;
                // What was planned was without it.
                planned.value = null;
              }}
            />
            {said.save}
          </label>
          <AfterSave saves={saves} free={free} />
          {n > 1 && (
            <label class="tick">
              <input
                type="checkbox"
                checked={goOn.value}
                onChange={event => {
                  goOn.value = event.currentTarget.checked;
                }}
              />
              {said.goOn}
            </label>
          )}
        </>
      )}
      {job !== null && <JobSteps kind={job.kind} steps={job.steps} label={said.steps} over={over} />}
    </Dialog>
  );
}

function Result({ one }: { one: Applied | undefined }) {
  if (!one) return null;
  const count = one.changes.filter(each => each.verdict !== "unchanged").length;
  const bad = one.problem !== null;
  return (
    <span class={bad ? "small strong k-failure" : "small second"} data-testid={`outcome-${one.uid}`}>
      {one.outcome === "planned" ? said.planned(count) : (said.outcome[one.outcome] ?? one.outcome)}
      {one.saved && `, ${said.savedToo}`}
      {one.left_out.length > 0 && `, ${said.left(one.left_out.length)}`}
    </span>
  );
}
