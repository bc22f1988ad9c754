/** The last two steps: progress of the job per servo, and the results. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Job } from "../api/types";
import { stopped } from "../bench/bench";
import type { ConditionKind } from "../bench/condition";
import { failureText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { connection } from "../bench/link";
import { readSheet, sheetOf } from "../bench/parameters";
import { beginChange } from "../change/flow";
import { JobSteps } from "../change/job-steps";
import { ReportLinks } from "../change/report-links";
import { batchSaveChange } from "../change/requests";
import { saving } from "../change/words";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { draft, resetDraft } from "./draft";
import { Actions, StepQuestion } from "./parts";
import { cancel, jobUnderWay, loadJobs, resume, retry, starting, startRefused } from "./state";
import {
  merged,
  resumableOf,
  type Tally,
  type Target,
  tally,
  type ValuesPlace,
  valuesPlaceOf,
} from "./targets";
import { commission as words } from "./words";

const strings = words.run;
const done = words.report;

export function RunStep({ jobs }: { jobs: readonly Job[] }) {
  const stopping = useSignal(false);
  // An earlier refusal no longer applies.
  useEffect(() => {
    startRefused.value = null;
  }, []);
  const targets = merged(jobs);
  const running = jobUnderWay.value;
  const uids = targets.map(one => one.uid);
  const load = () => {
    for (const uid of uids) readSheet(uid);
  };
  // After the job, the servos are read to find out where the values are.
  const over = running === null;
  const round = connection.value;
  useEffect(() => {
    if (over) load();
  }, [over, round, uids.join(" ")]);
  const sums = tally(targets, placeNow);
  const inRam = targets.filter(one => one.verdict === "done" && placeNow(one) === "ram").map(one => one.uid);
  const left = running ? null : resumableOf(jobs);
  const all = targets.length;
  const problem = startRefused.value;
  const saveAll = async () => {
    startRefused.value = null;
    const why = await beginChange(batchSaveChange(inRam));
    if (why !== null) startRefused.value = { text: why, uid: null, confirm: [] };
  };
  return (
    <>
      <StepQuestion title={running ? strings.title(sums.done + sums.ram, all) : reportTitle(sums, all)}>
        <p>
          {running
            ? `${strings.lead} ${strings.keep}`
            : leadOf(sums, all, jobs.at(-1)?.state === "cancelled")}
        </p>
        <Progress sums={sums} of={all} />
      </StepQuestion>
      <Scroll label={strings.targets} testid="run-step">
        {problem && <Note band>{problem.text}</Note>}
        <ul class="c-units" aria-label={running ? strings.targets : done.table}>
          {targets.map(target => (
            <TargetRow key={target.uid} target={target} over={running === null} />
          ))}
        </ul>
        {running === null && (
          <div class="c-reports">
            {jobs.map((job, place) => (
              <ReportLinks
                key={job.id}
                job={job.id}
                title={jobs.length === 1 ? done.files : done.filesOf(place + 1)}
              />
            ))}
          </div>
        )}
      </Scroll>
      <Actions>
        {running ? (
          <>
            <span class="grow" />
            <Button
              live
              testid="cancel-job"
              onClick={() => {
                stopping.value = true;
              }}
            >
              {strings.cancel}
            </Button>
          </>
        ) : (
          <>
            <span class="grow" />
            {left && sums.failed + sums.rest > 0 && (
              <Button live testid="resume" disabled={starting.value} onClick={() => void resume(left)}>
                {done.resume}
              </Button>
            )}
            <Button
              {...(inRam.length === 0 ? { look: "primary" as const } : {})}
              testid="more-servos"
              onClick={() => {
                resetDraft();
                void loadJobs();
              }}
            >
              {done.more}
            </Button>
            {inRam.length > 0 && (
              <Button
                look="primary"
                live
                testid="report-save"
                disabled={stopped.value}
                onClick={() => void saveAll()}
              >
                {saving.saveOnly}
              </Button>
            )}
          </>
        )}
      </Actions>
      {stopping.value && running && (
        <CancelDialog
          job={running}
          onClose={() => {
            stopping.value = false;
          }}
        />
      )}
    </>
  );
}

function placeNow(target: Target): ValuesPlace {
  return valuesPlaceOf(target, servo(target.uid), key => sheetOf(target.uid).reading(key).value);
}

/** Whether the values of these jobs are known to be in the ROM of every servo. */
export function finished(jobs: readonly Job[]): boolean {
  const targets = merged(jobs);
  return tally(targets, placeNow).done === targets.length;
}

function reportTitle(sums: Tally, of: number): string {
  if (sums.done === of) return done.allWell(of);
  if (sums.lost > 0) return done.notFinishedLost(sums.lost);
  return sums.ram > 0 ? done.notFinished(sums.ram) : done.some(sums.done, of);
}

function leadOf(sums: Tally, of: number, cancelled: boolean): string {
  if (sums.done === of) return done.leadRom;
  const parts = [
    cancelled ? done.cancelled : "",
    sums.ram > 0 ? done.leadRam : "",
    sums.lost > 0 ? done.leadLost : "",
    sums.failed + sums.rest > 0 ? done.leadFailed(sums.failed, sums.rest) : "",
  ];
  return parts.filter(Boolean).join(" ");
}

/** A scale with a tick for each servo. Ink is in ROM, blue in RAM only, red failed. */
function Progress({ sums, of }: { sums: Tally; of: number }) {
  const width = 600;
  const at = (n: number) => (of === 0 ? 0 : (n * width) / of);
  const inRam = sums.done + sums.ram;
  const parts = [
    { ink: "var(--ink)", from: 0, to: sums.done },
    { ink: "var(--intent)", from: sums.done, to: inRam },
    { ink: "var(--failure)", from: inRam, to: inRam + sums.lost + sums.failed },
  ];
  let path = `M0 9H${width}`;
  for (let i = 0; i <= of; i++) path += `M${at(i)} ${i === 0 || i === of ? 0 : 4}V9`;
  return (
    <svg
      class="c-progress"
      viewBox={`-1 0 ${width + 2} 15`}
      preserveAspectRatio="none"
      role="img"
      aria-label={reportTitle(sums, of)}
    >
      <path d={path} stroke="var(--edge)" fill="none" vector-effect="non-scaling-stroke" />
      {parts.map(one => (
        <path key={one.ink} d={`M${at(one.from)} 12H${at(one.to)}`} stroke={one.ink} stroke-width="4" />
      ))}
    </svg>
  );
}

const GLYPH: Record<Target["verdict"], ConditionKind | null> = {
  waiting: null,
  running: "busy",
  done: "ok",
  failed: "failure",
  not_tried: "offline",
};

function TargetRow({ target, over }: { target: Target; over: boolean }) {
  const opened = useSignal<boolean | null>(null);
  const { uid, record, steps, verdict } = target;
  const failure = record?.problem ?? target.job.error;
  const one = servo(uid);
  const entry = draft.value.entries[uid];
  const name = record?.label || entry?.label || nameOf(one) || record?.serial || uid.slice(0, 8);
  const serial = record?.serial ?? one?.serial ?? "";
  const active = verdict === "running" || verdict === "failed";
  const open = opened.value ?? active;
  const step = steps.find(each => each.state === "running");
  const id = record?.verdict === "done" ? record.servo_id : (one?.servo_id ?? record?.servo_id);
  const node = one?.online ? one.node_id : record?.node_id;
  const place = verdict === "done" ? placeNow(target) : null;
  const glyph = place === "lost" ? "failure" : place === "ram" ? null : GLYPH[verdict];
  const line =
    place !== null && record
      ? `${done.place[place]}, ${done.values(Object.keys(record.values).length)}`
      : verdict === "running" && step
        ? (strings.now[step.code] ?? step.text)
        : "";
  return (
    <li class="c-unit" data-testid={`run-${uid}`} data-verdict={verdict} data-place={place ?? ""}>
      <button
        type="button"
        class="c-row unit-head"
        aria-expanded={open}
        aria-label={strings.showSteps(name)}
        onClick={() => {
          opened.value = !open;
        }}
      >
        <span class="c-glyph">
          {place === "ram" ? (
            <span class="k-intent">
              <Icon name="half" />
            </span>
          ) : glyph ? (
            <Glyph kind={glyph} />
          ) : (
            <span class="ring" aria-hidden="true" />
          )}
        </span>
        <span class="c-who">
          <span class="serial">{name}</span>
          <span class="dim">{[serial === name ? "" : serial, record?.model].filter(Boolean).join(", ")}</span>
        </span>
        {verdict !== "done" && entry?.servoId ? (
          <span class="c-id k-intent">{words.find.id(entry.servoId)}</span>
        ) : (
          <span class="c-id">{words.find.id(String(id || NONE))}</span>
        )}
        <span class="c-node second">{words.find.node(String(node ?? NONE))}</span>
        <span class="c-verdict">
          <span class={place === "ram" ? "strong k-intent" : active || place === "lost" ? "strong" : ""}>
            {place === "ram" ? done.ramOnly : place === "lost" ? done.lost : strings.verdict[verdict]}
          </span>
          <small class="second">{line}</small>
        </span>
        <span class="c-chevron" data-open={open}>
          <Icon name="down" />
        </span>
      </button>
      {verdict === "failed" && (
        <div class="c-anomaly" role="alert">
          <p>
            <b>{failure ? failureText(failure) : strings.verdict.failed}</b>
          </p>
          {over && entry && (
            <div class="c-anomaly-do">
              <span class="second">{strings.what}</span>
              <Retry uid={uid} name={name} />
            </div>
          )}
        </div>
      )}
      {place === "lost" && over && entry && (
        <div class="c-anomaly" role="alert">
          <div class="c-anomaly-do">
            <span class="second">{done.lostLine}</span>
            <Retry uid={uid} name={name} />
          </div>
        </div>
      )}
      {open && steps.length > 0 && (
        <JobSteps
          kind="commissioning"
          steps={steps}
          label={strings.showSteps(name)}
          bare
          inRam={place === "ram" || place === "lost"}
          over={over}
        />
      )}
    </li>
  );
}

function Retry({ uid, name }: { uid: string; name: string }) {
  return (
    <button
      type="button"
      class="button"
      aria-label={strings.retryName(name)}
      data-testid={`retry-${uid}`}
      disabled={starting.value}
      onClick={() => void retry(uid)}
    >
      {strings.retry}
    </button>
  );
}

function CancelDialog({ job, onClose }: { job: Job; onClose: () => void }) {
  return (
    <Confirm
      title={strings.cancelTitle}
      verb={strings.cancelConfirm}
      cancel={strings.goOn}
      danger
      testid="cancel-dialog"
      actId="cancel-confirm"
      act={() => void cancel(job)}
      onClose={onClose}
    >
      <p>{strings.cancelText}</p>
    </Confirm>
  );
}
