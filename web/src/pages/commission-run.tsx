/** Owns the last two steps: the job servo by servo while it runs, and what became of each when it has ended. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Job } from "../api/types";
import { NONE } from "../form/format";
import { asking, cancel, recall, refused, resume, retry, underWay } from "../state/commission";
import { draft, startAnew } from "../state/commission-draft";
import { kindOf, merged, resumableOf, tally, type Unit } from "../state/commission-units";
import type { Kind } from "../state/condition";
import { nameOf, servo } from "../state/fleet";
import { commission as words } from "../text/topics";
import { Button } from "../ui/button";
import { Dialog } from "../ui/dialog";
import { Glyph } from "../ui/glyph";
import { Icon } from "../ui/icon";
import { Scroll } from "../ui/scroll";
import { Actions, Question } from "./commission-parts";
import { JobSteps } from "./job-steps";
import { ReportLinks } from "./report-links";

const said = words.run;
const done = words.report;

export function RunStep({ jobs }: { jobs: readonly Job[] }) {
  const stopping = useSignal(false);
  // A refusal is about what was tried before.
  useEffect(() => {
    refused.value = null;
  }, []);
  const units = merged(jobs);
  const running = underWay.value;
  const sums = tally(units);
  const left = running ? null : resumableOf(jobs);
  const all = units.length;
  const problem = refused.value;
  const held = units.every(one => one.sheet?.held_in === "rom");
  return (
    <>
      <Question title={running ? said.title(sums.done, all) : reportTitle(sums.done, all)}>
        <p>
          {running
            ? `${said.lead} ${said.keep}`
            : sums.done === all
              ? held
                ? done.leadRom
                : done.leadRam
              : `${jobs.at(-1)?.state === "cancelled" ? `${done.cancelled} ` : ""}${done.leadFailed(sums.failed, sums.rest)}`}
        </p>
        <Progress done={sums.done} failed={sums.failed} of={all} />
      </Question>
      <Scroll label={said.units} testid="run-step">
        {problem && (
          <div class="c-note bad" role="alert">
            <Glyph kind="failure" />
            <p class="grow">{problem.text}</p>
          </div>
        )}
        <ul class="c-units" aria-label={running ? said.units : done.table}>
          {units.map(unit => (
            <UnitRow key={unit.uid} unit={unit} over={running === null} />
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
              {said.cancel}
            </Button>
          </>
        ) : (
          <>
            <span class="grow" />
            {left && sums.done < all && (
              <Button live testid="resume" disabled={asking.value} onClick={() => void resume(left)}>
                {done.resume}
              </Button>
            )}
            <Button
              look="primary"
              testid="more-servos"
              onClick={() => {
                startAnew();
                void recall();
              }}
            >
              {done.more}
            </Button>
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

function reportTitle(behind: number, of: number): string {
  return behind === of ? done.allWell(of) : done.some(behind, of);
}

/** A ruled scale: a tick for each servo. */
function Progress({ done: behind, failed, of }: { done: number; failed: number; of: number }) {
  const width = 600;
  const at = (n: number) => (of === 0 ? 0 : (n * width) / of);
  let path = `M0 9H${width}`;
  for (let i = 0; i <= of; i++) path += `M${at(i)} ${i === 0 || i === of ? 0 : 4}V9`;
  return (
    <svg
      class="c-progress"
      viewBox={`-1 0 ${width + 2} 15`}
      preserveAspectRatio="none"
      role="img"
      aria-label={reportTitle(behind, of)}
    >
      <path d={path} stroke="var(--edge)" fill="none" vector-effect="non-scaling-stroke" />
      <path d={`M0 12H${at(behind)}`} stroke="var(--ink)" stroke-width="4" />
      <path d={`M${at(behind)} 12H${at(behind + failed)}`} stroke="var(--failure)" stroke-width="4" />
    </svg>
  );
}

const GLYPH: Record<Unit["verdict"], Kind | null> = {
  waiting: null,
  running: "busy",
  done: "ok",
  failed: "failure",
  not_tried: "offline",
};

function UnitRow({ unit, over }: { unit: Unit; over: boolean }) {
  const opened = useSignal<boolean | null>(null);
  const { uid, sheet, steps, verdict } = unit;
  const one = servo(uid);
  const entry = draft.value.entries[uid];
  const name = sheet?.label || entry?.label || nameOf(one) || sheet?.serial || uid.slice(0, 8);
  const serial = sheet?.serial ?? one?.serial ?? "";
  const active = verdict === "running" || verdict === "failed";
  const open = opened.value ?? active;
  const step = steps.find(each => each.state === "running");
  const id = sheet?.verdict === "done" ? sheet.servo_id : (one?.servo_id ?? sheet?.servo_id);
  const node = one?.online ? one.node_id : sheet?.node_id;
  const glyph = GLYPH[verdict];
  const line =
    verdict === "done" && sheet
      ? `${done.held[sheet.held_in] ?? ""}, ${done.values(Object.keys(sheet.values).length)}`
      : verdict === "running" && step
        ? (said.now[kindOf(step)] ?? step.text)
        : "";
  return (
    <li class="c-unit" data-testid={`run-${uid}`} data-verdict={verdict}>
      <button
        type="button"
        class="c-row unit-head"
        aria-expanded={open}
        aria-label={said.showSteps(name)}
        onClick={() => {
          opened.value = !open;
        }}
      >
        <span class="c-glyph">
          {glyph ? <Glyph kind={glyph} /> : <span class="ring" aria-hidden="true" />}
        </span>
        <span class="c-who">
          <span class="serial">{name}</span>
          <span class="dim">{[serial === name ? "" : serial, sheet?.model].filter(Boolean).join(", ")}</span>
        </span>
        {verdict !== "done" && entry?.servoId ? (
          <span class="c-id k-intent">{words.find.id(entry.servoId)}</span>
        ) : (
          <span class="c-id">{words.find.id(String(id || NONE))}</span>
        )}
        <span class="c-node second">{words.find.node(String(node ?? NONE))}</span>
        <span class="c-verdict">
          <span class={active ? "strong" : ""}>{said.verdict[verdict]}</span>
          <small class="second">{line}</small>
        </span>
        <span class="c-chevron" data-open={open}>
          <Icon name="down" />
        </span>
      </button>
      {verdict === "failed" && (
        <div class="c-anomaly" role="alert">
          <p>
            <b>{sheet?.problem ?? unit.job.error?.detail ?? said.verdict.failed}</b>
          </p>
          {over && entry && (
            <div class="c-anomaly-do">
              <span class="second">{said.what}</span>
              <button
                type="button"
                class="button"
                aria-label={said.retryName(name)}
                data-testid={`retry-${uid}`}
                disabled={asking.value}
                onClick={() => void retry(uid)}
              >
                {said.retry}
              </button>
            </div>
          )}
        </div>
      )}
      {open && steps.length > 0 && <JobSteps steps={steps} label={said.showSteps(name)} bare />}
    </li>
  );
}

function CancelDialog({ job, onClose }: { job: Job; onClose: () => void }) {
  return (
    <Dialog
      title={said.cancelTitle}
      testid="cancel-dialog"
      onClose={onClose}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={onClose}>{said.goOn}</Button>
          </span>
          <Button
            look="danger"
            live
            testid="cancel-confirm"
            onClick={() => {
              onClose();
              void cancel(job);
            }}
          >
            {said.cancelConfirm}
          </Button>
        </>
      }
    >
      <p>{said.cancelText}</p>
    </Dialog>
  );
}
