/** The line above every curve: what the last run shows, what to try next, and the way back to run A. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { RunVerdict, StepRun } from "../api/lab-types";
import { noteText, verdictText } from "../bench/note-text";
import { sheetOf } from "../bench/parameters";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { guideAt } from "../kit/guide";
import { Spinner } from "../kit/icon";
import { dialog } from "./dialogs";
import { gainsOf, LetterBox } from "./legend";
import { overlay, restoreGains, runs, runsProblem, testing } from "./state";
import { gainsToRestore, letter } from "./step-runs";
import { tune as words } from "./words";

export function VerdictLine({ uid, locked }: { uid: string; locked: boolean }) {
  const strings = words.verdict;
  const shown = overlay.value?.runs ?? [];
  const last = shown.at(-1);
  const first = shown.length > 1 ? shown[0] : undefined;
  if (!last) {
    const loading = runs.value === null && runsProblem.value === null;
    const none = runs.value?.length === 0;
    return (
      <Line level="none" testid={none ? "no-runs" : "verdict-loading"}>
        <h2>{none ? strings.none : loading ? words.runs.loading : strings.noneShown}</h2>
        {/* While runs are loaded, the line is already as high as without any. */}
        <p class={loading ? "second unseen" : "second"}>
          {none || loading ? `${strings.noneLine} ` : ""}
          <HowToRead />
        </p>
      </Line>
    );
  }
  const { verdict } = last;
  return (
    <Line
      level={verdict.level}
      testid="verdict"
      right={
        <div class="tune-other">
          {first && <OtherRun run={first} />}
          <BackButton uid={uid} run={first ?? last} locked={locked} place={0} quiet={!first} />
        </div>
      }
    >
      <h2>
        {first && (
          <>
            <LetterBox place={shown.length - 1} />{" "}
          </>
        )}
        {verdictText(verdict)}
      </h2>
      <p class="second">
        {verdict.advice && `${noteText(verdict.advice.text, verdict.advice.code, verdict.advice.params)} `}
        <HowToRead />
      </p>
    </Line>
  );
}

interface LineProps {
  level: RunVerdict["level"] | "none";
  testid: string;
  right?: ComponentChildren;
  children: ComponentChildren;
}

function Line({ level, testid, right, children }: LineProps) {
  return (
    <section
      class="tune-verdict"
      data-level={level}
      data-testid={testid}
      aria-label={words.verdict.label}
      aria-live="polite"
    >
      {level !== "none" && <Glyph kind={level} size={24} />}
      <div class="tune-said">{children}</div>
      {right}
    </section>
  );
}

function HowToRead() {
  return (
    <a class="link" href={guideAt("tuning")} target="_blank" rel="noreferrer" data-testid="guide-tuning">
      {words.verdict.howToRead}
    </a>
  );
}

/** One line about the run compared with. */
function OtherRun({ run }: { run: StepRun }) {
  return (
    <div class="tune-other-run" data-testid="verdict-other">
      <Glyph kind={run.verdict.level} size={16} />
      <span>
        <span class="tune-other-said">
          <LetterBox place={0} /> {verdictText(run.verdict)}
        </span>
        <small class="second">
          {[gainsOf(run), inRom(run) ? words.verdict.inRom : ""].filter(Boolean).join(", ")}
        </small>
      </span>
    </div>
  );
}

/** Whether ROM has the gains of a run. */
function inRom(run: StepRun): boolean {
  const sheet = sheetOf(run.uid);
  return gainsToRestore(run, key => sheet.reading(key).value?.rom ?? undefined).size === 0;
}

interface BackProps {
  uid: string;
  run: StepRun;
  place: number;
  locked: boolean;
  /** Not shown while the servo has these gains. */
  quiet: boolean;
}

/** Writes the gains of a run to RAM. */
function BackButton({ uid, run, place, locked, quiet }: BackProps) {
  const strings = words.verdict;
  const writing = useSignal(false);
  const sheet = sheetOf(uid);
  const values = gainsToRestore(run, key => sheet.held(key));
  const name = letter(place);
  if (values.size === 0 && quiet) return null;
  if (values.size === 0) return <span class="small second">{strings.same(name)}</span>;
  const act = async () => {
    writing.value = true;
    await restoreGains(uid, values);
    writing.value = false;
  };
  return (
    <Button
      live
      testid={`back-to-${name}`}
      title={strings.backHint(name)}
      disabled={locked || testing.value || writing.value || sheet.busy.value !== null}
      onClick={() => void act()}
    >
      {writing.value && <Spinner />}
      {quiet ? strings.backToRun : strings.back(name)}
    </Button>
  );
}

/** The button that opens the step dialog, in the line while nothing is measured. */
export function FirstStep() {
  return (
    <Button
      live
      testid="first-step"
      onClick={() => {
        dialog.value = "step";
      }}
    >
      {words.step.open}
    </Button>
  );
}
