/** Verify live: one row per output, and the step to do now. */
import { useEffect } from "preact/hooks";
import type { Verification, VerifyRow } from "../api/autopilot-types";
import { monotonic, now } from "../bench/clock";
import { angle, number, withUnit } from "../bench/format";
import { poll } from "../bench/poll";
import { Button } from "../kit/button";
import { type Column, DataTable } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { RangeScale } from "./range-scale";
import {
  beginStep,
  causeOf,
  countsOf,
  endVerification,
  halfRange,
  neutralDone,
  nextStep,
  nothingMoved,
  presentStep,
  readAt,
  readVerification,
  silent,
  toneOf,
  type VerifyStepNow,
  verifyProblem,
} from "./verification";
import { autopilotWords as words } from "./words";

const POLL_MS = 250;

export function Verify({ state, source }: { state: Verification; source: string }) {
  useEffect(() => poll(POLL_MS, readVerification).end, []);
  const counts = countsOf(state.rows);
  const half = halfRange(state.rows);
  return (
    <section class="verify" aria-label={words.verify} data-testid="verify">
      <header class="part-head">
        <h2>{words.verify}</h2>
        <span class="second">{source}</span>
        <span class="small second" data-testid="verify-counts">
          {words.counts(counts.ok, counts.failure, counts.warning, counts.none)}
        </span>
        <span class="grow" />
        <StepNow state={state} />
        <Button live testid="verify-cancel" onClick={() => void endVerification()}>
          {counts.none === 0 ? words.close : words.cancel}
        </Button>
      </header>
      <Note band>{verifyProblem.value}</Note>
      <DataTable
        label={words.verify}
        testid="verify-table"
        rows={state.rows}
        id={one => one.output}
        data={one => ({ testid: `verify-${one.output}`, result: one.result, tone: toneOf(one) })}
        columns={columns(state, half)}
      />
    </section>
  );
}

function columns(state: Verification, half: number): readonly Column<VerifyRow>[] {
  const head = words.verifyHead;
  const label = (one: VerifyRow) => one.label || words.of(one.output, `ID ${one.servo_id}`);
  return [
    { key: "output", head: head.output, cell: one => one.output },
    { key: "servo", head: head.servo, name: true, cell: one => <b>{label(one)}</b> },
    { key: "exported", head: head.exported, cell: one => angle(one.positive_deg) },
    { key: "bus", head: head.bus, cell: one => <OnTheBus one={one} /> },
    {
      key: "seen",
      head: head.seen(angle(-half).replace(".0", ""), angle(half).replace(".0", "")),
      cell: one => <RangeScale one={one} half={half} />,
    },
    { key: "result", head: head.result, cell: one => <Result one={one} /> },
    {
      key: "cause",
      head: head.cause,
      cell: one => <span class="second">{causeOf(state.program, one, state.rows)}</span>,
    },
    {
      key: "measure",
      head: head.measure,
      bare: true,
      right: true,
      cell: one => (
        <Button
          live
          disabled={state.step !== null || one.result === "missing"}
          testid={`measure-${one.output}`}
          label={words.measureOne(one.output)}
          onClick={() => void beginStep({ kind: "positive", output: one.output })}
        >
          {words.measure}
        </Button>
      ),
    },
  ];
}

function OnTheBus({ one }: { one: VerifyRow }) {
  if (one.result === "missing") return <b>{words.noEntry}</b>;
  if (one.held_deg === null) return <span class="dim">{angle(one.last_deg)}</span>;
  return toneOf(one) === "failure" || toneOf(one) === "warning" ? (
    <b>{angle(one.held_deg)}</b>
  ) : (
    <span>{angle(one.held_deg)}</span>
  );
}

function Result({ one }: { one: VerifyRow }) {
  const tone = toneOf(one);
  const word =
    one.result === "swapped" ? words.result.swapped(one.swapped_with ?? 0) : words.result[one.result];
  if (tone === "none") return <span class="second">{word}</span>;
  return (
    <span class="verify-result">
      <Glyph kind={tone} />
      {tone === "ok" ? word : <b>{words.of(one.output, word)}</b>}
    </span>
  );
}

/** What to do now, with its countdown while it is measured. */
function StepNow({ state }: { state: Verification }) {
  const present = presentStep(state);
  const step = present ?? nextStep(state.rows, neutralDone.value);
  if (present === null && silent(state.rows))
    return (
      <p class="verify-step" role="status" data-testid="verify-step">
        {words.silent}
      </p>
    );
  if (step === null)
    return (
      <p class="verify-step" role="status" data-testid="verify-step">
        {words.done}
      </p>
    );
  const again = present === null && step.output !== null && nothingMoved.value === step.output;
  // The clock of the page ticks once a second: the poll is faster.
  const since = Math.max(0, Math.max(now.value, monotonic()) - readAt.value);
  const left = Math.max(0, (state.left_s ?? 0) - Math.min(since, 1));
  return (
    <p class="verify-step" data-testid="verify-step" data-running={present !== null}>
      {present && <Spinner />}
      <span role="status">
        <b>{again ? words.again : words.step(step.n, step.of)}</b> {wordsOfStep(step, state.rows)}
      </span>
      {present ? (
        <span class="second verify-left">
          {words.left(number(state.hold_s - left, 1), withUnit(number(state.hold_s, 1), "s"))}
        </span>
      ) : (
        <Button live look="primary" testid="verify-measure" onClick={() => void beginStep(step)}>
          {words.measure}
        </Button>
      )}
    </p>
  );
}

function wordsOfStep({ kind, output }: VerifyStepNow, list: readonly VerifyRow[]): string {
  if (kind === "neutral" || output === null) return words.neutral;
  return words.positive(output, list.find(one => one.output === output)?.label ?? "");
}
