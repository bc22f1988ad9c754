/** The part "Autopilot" of the Bus page: the plan, its file, and live verification. */
import { useEffect } from "preact/hooks";
import type { AutopilotProgram } from "../api/autopilot-types";
import { bus } from "../bench/bench";
import { channelOf } from "../bench/bus-now";
import { connection } from "../bench/link";
import { Button } from "../kit/button";
import { cell, FilePick, TextField } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { Segments } from "../kit/segments";
import {
  advice,
  adviceByCode,
  drafts,
  edit,
  exportPlan,
  importPlan,
  incomplete,
  PROGRAMS,
  planNote,
  planOf,
  planProblem,
  proposeOutputs,
  rateOf,
  rows,
} from "./plan";
import { PlanTable } from "./plan-table";
import { beginVerification, resumeVerification, verification, verifyProblem } from "./verification";
import { Verify } from "./verify";
import { autopilotWords as words } from "./words";
import "./autopilot.css";

export function AutopilotPart() {
  const { program, rate } = drafts.value;
  const round = connection.value;
  const missing = rows.value === null;
  useEffect(() => void resumeVerification(), [round]);
  useEffect(() => {
    if (missing) void proposeOutputs(program);
  }, [program, missing, round]);
  const plan = planOf(drafts.value);
  const state = verification.value;
  const open = incomplete.value;
  return (
    <Scroll label={words.title} testid="autopilot">
      {state && <Verify state={state} source={sourceText()} />}
      <header class="part-head ap-head">
        <h2>{words.outputs}</h2>
        <Segments<AutopilotProgram>
          label={words.program}
          chosen={program}
          onChoose={key => edit({ program: key })}
          options={PROGRAMS.map(key => ({ key, label: words.programs[key] }))}
        />
        {program === "ardupilot" && (
          <TextField
            label={words.rate}
            beside
            short
            number
            unit="Hz"
            testid="plan-rate"
            error={rateOf(rate) === null}
            at={cell(rate, next => edit({ rate: next }))}
          />
        )}
        <span class="grow" />
        <Button live testid="plan-propose" onClick={() => void proposeOutputs()}>
          {words.propose}
        </Button>
        <FilePick
          label={words.import}
          accept=".param,.params,.parm,.txt"
          testid="plan-import"
          onFile={file => void importPlan(file)}
        />
        <Button
          live
          {...(state ? {} : { look: "primary" as const })}
          testid="plan-export"
          disabled={plan === null}
          onClick={() => void exportPlan(download)}
        >
          <Icon name="download" size={15} /> {words.export}
        </Button>
        {!state && (
          <Button
            live
            testid="verify-begin"
            disabled={plan === null}
            onClick={() => plan && void beginVerification(plan)}
          >
            {words.verify}
          </Button>
        )}
      </header>
      <p class="second ap-line">{words.line}</p>
      <Note band testid="plan-problem">
        {planProblem.value ?? (state ? null : verifyProblem.value)}
      </Note>
      {open.length > 0 && (
        <Note kind="warning" band testid="plan-incomplete">
          {words.incomplete(open)}
        </Note>
      )}
      <Note kind="ok" band testid="plan-note">
        {planNote.value}
      </Note>
      {advice.value.length > 0 && <AdviceList />}
      <PlanTable program={program} />
    </Scroll>
  );
}

function sourceText(): string {
  return words.against(drafts.value.source || words.thisPlan, channelOf(bus.value?.address));
}

function AdviceList() {
  return (
    <section class="ap-advice" aria-label={words.advice} data-testid="plan-advice">
      <h3>{words.advice}</h3>
      <ul>
        {adviceByCode(advice.value).map(one => (
          <li key={one.code} data-code={one.code}>
            <Glyph kind="notice" size={14} />
            <span>{words.advices[one.code](one.outputs)}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** Save text as a file of the browser. */
function download(name: string, content: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type: "text/plain" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
