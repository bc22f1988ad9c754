/** The dialog of every change: plan, movement, confirmations, then progress and result. */
import { useEffect } from "preact/hooks";
import { type KnownServo, nameOf, servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { route } from "../bench/route";
import { Button } from "../kit/button";
import { Dialog, Quit } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { text } from "../text";
import type { About } from "./changing.en";
import { whyRefused } from "./consequences";
import { begun, type ChangeFlow, closeChange, type Part, shownChange } from "./flow";
import { HornForecast } from "./horn-forecast";
import { OutputQuestion, outputKept, ProfileServos, ResetName, ResetOptions } from "./kinds";
import { PlanParts } from "./plan";
import { PlanQuestion, PlanRun } from "./plan-parts";
import type { PlanFacts } from "./plan-request";
import { Progress } from "./progress";
import type { ProfileFacts } from "./requests";
import { wordsOf } from "./safety-words";
import { AfterRestart, HornFreeTick, SafetyTicks, SaveTick } from "./ticks";
import { saving, changing as strings } from "./words";
import "../kit/table.css";
import "./change.css";

export function ChangeDialog() {
  const flow = shownChange.value;
  const { page, uid } = route.value;
  const here = `${page}/${uid}`;
  // Leaving the page cancels a question; a running change continues.
  useEffect(() => closeChange, [here]);
  return flow && <Opened key={id(flow)} flow={flow} />;
}

/** Reopens changes whose dialog is hidden. */
export function HiddenChanges() {
  return begun.value
    .filter(flow => flow !== shownChange.value && strings.kinds[flow.request.kind].running !== undefined)
    .map(flow => (
      <section
        class="link-band prompt"
        data-testid="change-band"
        data-phase={flow.phase.value}
        key={id(flow)}
      >
        <Button
          testid="change-show"
          onClick={() => {
            shownChange.value = flow;
          }}
        >
          {strings.show}
        </Button>
        <span role="status">
          {flow.phase.value === "running" ? <Spinner /> : <Glyph kind="failure" />}{" "}
          {titleOf(flow, aboutOf(flow))}
        </span>
      </section>
    ));
}

const ids = new WeakMap<ChangeFlow, number>();
let last = 0;

function id(flow: ChangeFlow): number {
  if (!ids.has(flow)) ids.set(flow, ++last);
  return ids.get(flow) ?? 0;
}

function Opened({ flow }: { flow: ChangeFlow }) {
  const { request } = flow;
  const about = aboutOf(flow);
  const phase = flow.phase.value;
  const words = strings.kinds[request.kind];
  const reported =
    phase === "over" || flow.turns.value.some(turn => turn.job !== null || turn.state === "done");
  const progress = reported && words.running !== undefined;
  // The rows show the result of an edit.
  const done = phase === "over" && (request.kind === "apply" || (request.quick === true && flow.well));
  useEffect(() => {
    if (done) closeChange();
  }, [done]);
  // The focused button disappears with the question.
  useEffect(() => {
    if (progress) document.querySelector<HTMLElement>("[data-testid=change-close]")?.focus();
  }, [progress]);
  return progress || (phase === "over" && !done) ? (
    <Dialog
      title={titleOf(flow, about)}
      subtitle={
        phase === "over"
          ? subtitleOver(flow)
          : request.kind === "output"
            ? strings.output.stop
            : isPlan(flow)
              ? strings.plan.alone
              : strings.keepOn
      }
      testid="job-dialog"
      onClose={closeChange}
      foot={
        <>
          <span class="small second">{count(flow)}</span>
          <span class="grow" />
          <Quit
            testid="change-close"
            onClose={closeChange}
            word={phase === "over" ? text.job.close : text.job.hide}
          />
        </>
      }
    >
      {isPlan(flow) && flow.jobs.map(job => <PlanRun key={job.id} job={job} />)}
      <Progress flow={flow} />
      {phase === "over" && outputKept(flow) && <p class="second">{strings.output.keeps}</p>}
    </Dialog>
  ) : (
    <Dialog
      title={words.title(about)}
      subtitle={subtitle(flow)}
      testid={`${request.kind}-dialog`}
      onClose={closeChange}
      foot={<Foot flow={flow} about={about} />}
    >
      <Question flow={flow} />
    </Dialog>
  );
}

function Question({ flow }: { flow: ChangeFlow }) {
  const { kind } = flow.request;
  const problem = flow.problem.value;
  const waits = flow.phase.value !== "ready";
  const parts = flow.able.value;
  const alone = parts.length === 1 ? parts[0] : undefined;
  const one = alone && servo(alone.uid);
  const verb = kind === "save" || kind === "restart" || kind === "factory-reset" ? kind : null;
  return (
    <>
      {problem &&
        (wordsOf(problem).length > 0 ? (
          <p class="confirmation" role="alert">
            <Glyph kind="warning" size={18} /> <span>{whyRefused(problem)}</span>
          </p>
        ) : (
          <Note testid="change-refused">{strings.refused(whyRefused(problem))}</Note>
        ))}
      {kind === "output" && <OutputQuestion flow={flow} />}
      {isPlan(flow) && <PlanQuestion flow={flow} />}
      {kind === "profile" && <ProfileServos flow={flow} />}
      {verb && alone?.restart && one ? (
        <HornForecast one={one} forecast={alone.restart} verb={verb}>
          {verb === "save" && <SaveNotes one={one} part={alone} />}
        </HornForecast>
      ) : null}
      {kind === "factory-reset" && <ResetOptions flow={flow} />}
      <PlanParts flow={flow} />
      <SafetyTicks requested={flow.required.value} agreed={flow.agreed} disabled={waits} />
      <SaveTick flow={flow} />
      {!(verb && alone) && <AfterRestart flow={flow} />}
      {flow.current.value && <HornFreeTick of={flow.free} />}
      {kind === "factory-reset" && <ResetName flow={flow} />}
    </>
  );
}

/** Effects of a save besides the saved values. */
function SaveNotes({ one, part }: { one: KnownServo; part: Part }) {
  const off = one.output.state === "off" || one.output.state === "brake";
  const comesOn = off && part.restart && !["no_torque", "brake", "unknown"].includes(part.restart.code);
  const identity = part.rom?.some(each => each.key === "servo_id" || each.key === "node_id");
  return (
    <>
      {comesOn && <p>{saving.outputOn}</p>}
      {identity && <p>{saving.idChange}</p>}
    </>
  );
}

function Foot({ flow, about }: { flow: ChangeFlow; about: About }) {
  const { request } = flow;
  const phase = flow.phase.value;
  const busy = phase === "planning" || phase === "running";
  // A confirmation counts only once the server has checked it again.
  const again = !flow.current.value || (flow.open.value && request.plan !== undefined);
  const words = strings.kinds[request.kind];
  const chooses = request.kind === "profile" && flow.parts.value === null;
  const other = async () => {
    await flow.instead();
    if (flow.problem.peek() === null) closeChange();
  };
  return (
    <>
      {busy && (
        <span class="k-intent working">
          <Spinner /> {phase === "planning" ? strings.planning : strings.working}
        </span>
      )}
      <span class="grow" />
      <Quit testid="change-cancel" onClose={closeChange} word={text.cancel} />
      {request.other && words.other && (
        <Button
          live
          testid="change-other"
          disabled={busy || (flow.parts.value?.length ?? 0) === 0}
          onClick={() => void other()}
        >
          {words.other}
        </Button>
      )}
      {again ? (
        <Button
          look="primary"
          live
          testid="change-again"
          disabled={busy || flow.open.value || (chooses && !(request.ready?.() ?? true))}
          onClick={() => void flow.look()}
        >
          {chooses ? strings.preview : strings.again}
        </Button>
      ) : (
        <Button
          look={request.kind === "factory-reset" || isPlan(flow) ? "danger" : "primary"}
          live
          testid={`${request.kind}-go`}
          disabled={busy || !flow.mayGo.value}
          onClick={() => void flow.go()}
        >
          {words.go(about)}
        </Button>
      )}
    </>
  );
}

const isPlan = ({ request }: ChangeFlow) => request.kind === "plan" || request.kind === "plan-resume";

/** The servo of the change, if it is one. */
function aloneOf(flow: ChangeFlow): KnownServo | undefined {
  const { facts } = flow.request;
  const parts = flow.parts.value ?? [];
  const uid = typeof facts === "string" ? facts : parts.length === 1 ? parts[0]?.uid : undefined;
  return uid === undefined ? undefined : servo(uid);
}

function aboutOf(flow: ChangeFlow): About {
  const { request } = flow;
  const able = flow.able.value;
  const values = able.reduce((sum, one) => sum + one.changes.length, 0);
  return {
    name:
      request.kind === "profile" || isPlan(flow)
        ? (request.facts as ProfileFacts | PlanFacts).name
        : nameOf(aloneOf(flow) ?? servo(able[0]?.uid ?? null)),
    servos: request.kind.startsWith("batch") && able.length === 0 ? (request.count ?? 0) : able.length,
    values:
      request.kind === "save"
        ? able.reduce((sum, one) => sum + (one.rom?.length ?? 0), 0)
        : (request.count ?? values),
    save: flow.save.value,
  };
}

function subtitle(flow: ChangeFlow) {
  const { kind } = flow.request;
  const one = aloneOf(flow);
  if (["save", "restart", "factory-reset"].includes(kind) && one) {
    return strings.facts(one.model ?? NONE, one.serial ?? NONE, String(one.servo_id ?? NONE));
  }
  if (kind === "restart") return strings.inTurn;
  return strings.kinds[kind].lead;
}

/** After a write, only the read-back shows what ROM contains. */
const unsure = (flow: ChangeFlow) =>
  flow.jobs.some(job => job.steps.some(one => one.code === "write" && one.state === "done"));

function titleOf(flow: ChangeFlow, about: About): string {
  const { kind } = flow.request;
  const words = strings.kinds[kind];
  if (flow.phase.value !== "over") return words.running?.(about) ?? words.title(about);
  if (flow.well) return words.done?.(about) ?? words.title(about);
  if (kind === "save" && unsure(flow)) return text.job.unsure(about.name);
  const bad = flow.turns.value.filter(turn => turn.state === "failed" || turn.state === "left_out").length;
  return (
    words.failed?.({ ...about, servos: flow.request.together ? about.servos : bad }) ?? words.title(about)
  );
}

function subtitleOver(flow: ChangeFlow): string | undefined {
  return flow.request.kind === "save" && flow.well ? text.job.doneText(flow.request.count ?? 0) : undefined;
}

function count(flow: ChangeFlow): string {
  const turns = flow.turns.value;
  const [only] = turns;
  if (turns.length !== 1 || !only) {
    return strings.of(turns.filter(turn => turn.state === "done").length, turns.length);
  }
  const [job] = flow.jobs;
  const at = job?.steps.findIndex(step => step.state === "running") ?? -1;
  if (job && flow.request.kind === "save" && flow.phase.value !== "over") {
    return text.job.step(Math.max(1, at + 1), job.steps.length);
  }
  return strings.state[only.state];
}
