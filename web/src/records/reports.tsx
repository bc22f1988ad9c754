/** The reports: results of jobs, newest first, for download or printing. */

import { useSignal } from "@preact/signals";
import { callApi } from "../api/client";
import type { Job } from "../api/types";
import { openCommissioning } from "../bench/commission-open";
import type { ConditionKind } from "../bench/condition";
import { failureText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { ended, jobs, setJob } from "../bench/jobs";
import { up } from "../bench/link";
import { resultText } from "../bench/note-text";
import { go, pathOf } from "../bench/route";
import { beginChange } from "../change/flow";
import { JobSteps } from "../change/job-steps";
import { PlanRun } from "../change/plan-parts";
import { planChange, planResult } from "../change/plan-request";
import { ReportLinks } from "../change/report-links";
import { Button } from "../kit/button";
import { FilePick } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Empty, instant } from "../kit/loaded";
import { Note } from "../kit/note";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { records as words } from "./words";

const strings = words.reports;

const GLYPH: Record<Job["state"], ConditionKind> = {
  queued: "identifying",
  running: "busy",
  succeeded: "ok",
  failed: "failure",
  cancelled: "warning",
};

/** Longest plan file, bytes. A plan usually has one or two kB. */
const LONGEST = 64 * 1024;

/** Chooses a plan file. It is checked, and starts after a confirmation only. */
function RunPlan() {
  const busy = useSignal(false);
  const problem = useSignal<string | null>(null);
  const choose = async (file: File) => {
    busy.value = true;
    problem.value =
      file.size > LONGEST ? strings.tooLarge(file.name) : await beginChange(planChange(await file.text()));
    busy.value = false;
  };
  return (
    <>
      <div class="list-bar r-tools">
        <p class="second grow">{strings.planLead}</p>
        <FilePick
          label={strings.runPlan}
          accept=".toml"
          testid="plan-file"
          busy={busy.value}
          disabled={!up.value}
          onFile={file => void choose(file)}
        />
      </div>
      <Note band testid="plan-refused">
        {problem.value}
      </Note>
    </>
  );
}

export function Reports() {
  const wiggles = useSignal(false);
  const open = useSignal<string | null>(null);
  const list = useResource(async () => {
    for (const job of await callApi("GET", "/jobs")) setJob(job);
    return true;
  });
  // Includes jobs that started since; the socket reports them.
  const known = [...jobs.value.values()].sort((a, b) => b.created_at - a.created_at);
  const found = list.value.value === null ? null : known;
  const shown = found?.filter(job => wiggles.value || job.kind !== "identify") ?? [];
  return (
    <>
      <RunPlan />
      <Scroll label={words.reportsTab} testid="reports">
        <Loaded of={list} loading={words.loading} />
        {found !== null && shown.length === 0 && (
          <Empty title={strings.empty} guides={["commission"]}>
            {strings.emptyLine}
          </Empty>
        )}
        <ul>
          {shown.map(job => {
            const plan = planResult(job)?.plan;
            const kind = strings.kind[job.kind] ?? job.kind;
            const what = plan === undefined ? kind : `${kind}: ${plan}`;
            const about = new Set(job.steps.flatMap(step => (step.uid ? [step.uid] : []))).size;
            const who =
              job.uid !== null ? nameOf(servo(job.uid)) || job.uid.slice(0, 8) : strings.several(about);
            const result = resultText(job.result);
            const unfolded = open.value === job.id;
            return (
              <li key={job.id} class="list-line" data-testid={`job-${job.id}`}>
                <div class="list-head">
                  <button
                    type="button"
                    class="list-open list-job"
                    aria-expanded={unfolded}
                    aria-label={strings.steps(`${what}, ${who}`)}
                    onClick={() => {
                      open.value = unfolded ? null : job.id;
                    }}
                  >
                    <Glyph kind={GLYPH[job.state]} />
                    <span class="grow">
                      <span class="strong">
                        {what}, {who}
                      </span>
                      <small>
                        {instant(job.created_at)}, {strings.state[job.state]}
                        {job.error ? `. ${failureText(job.error)}` : result && `. ${result}`}
                      </small>
                    </span>
                    <span class="c-chevron" data-open={unfolded}>
                      <Icon name="down" />
                    </span>
                  </button>
                </div>
                {unfolded && (
                  <div class="r-rows">
                    {job.kind === "plan" && <PlanRun job={job} />}
                    <JobSteps
                      kind={job.kind}
                      steps={job.steps}
                      label={strings.steps(what)}
                      over={ended(job)}
                    />
                    <div class="r-actions">
                      {job.kind !== "plan" && <ReportLinks job={job.id} title={strings.report} />}
                      {job.kind === "commissioning" && (
                        <Button
                          onClick={() => {
                            setJob(job);
                            openCommissioning.value = job.id;
                            go(pathOf("commission", null));
                          }}
                        >
                          {strings.open}
                        </Button>
                      )}
                    </div>
                  </div>
                )}
              </li>
            );
          })}
        </ul>
        {found?.some(job => job.kind === "identify") && !wiggles.value && (
          <p class="w-line">
            <button
              type="button"
              class="link"
              onClick={() => {
                wiggles.value = true;
              }}
            >
              {strings.wiggles}
            </button>
          </p>
        )}
      </Scroll>
    </>
  );
}
