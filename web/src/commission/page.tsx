/** The Commission page: the bar of steps, and the present step. */
import { useEffect, useMemo } from "preact/hooks";
import { connection } from "../bench/link";
import { observing } from "../bench/role";
import { Icon } from "../kit/icon";
import { text } from "../text";
import { CheckStep } from "./check";
import { changeDraft, count, draft, type Step, wanted } from "./draft";
import { FindStep } from "./find";
import { IdentifyStep } from "./identify";
import { ProfileStep } from "./profile";
import { finished, RunStep } from "./run";
import {
  candidates,
  jobUnderWay,
  known,
  loadJobs,
  mine,
  showOpened,
  watchCandidates,
  watchJobs,
} from "./state";
import { commission as words } from "./words";
import "../kit/table.css";
import "./commission.css";

type Shown = Step | "run" | "report";
const ORDER: readonly Shown[] = ["find", "identify", "profile", "check", "run", "report"];

export function CommissionPage() {
  useMemo(showOpened, []);
  const round = connection.value;
  useEffect(() => {
    const polls = [watchCandidates(), watchJobs()];
    return () => {
      for (const one of polls) one.end();
    };
  }, []);
  // Again after each connection: the server may have restarted.
  useEffect(() => {
    void loadJobs();
  }, [round]);
  const shown = shownNow();
  // A running job stays in view.
  if (observing.value && !jobUnderWay.value) {
    return (
      <div class="page">
        <section class="empty" data-testid="commission-observer">
          <div>
            <h1>{words.observing}</h1>
            <p class="second">{text.motion.whileObserving}</p>
          </div>
        </section>
      </div>
    );
  }
  return (
    <div class="page commission" data-testid="commission-page" data-step={shown}>
      <Steps shown={shown} />
      {shown === null && (
        <p class="notice-line">
          {candidates.problem.value === null ? words.loading : words.failed(candidates.problem.value)}
        </p>
      )}
      {shown === "find" && <FindStep />}
      {shown === "identify" && <IdentifyStep />}
      {shown === "profile" && <ProfileStep />}
      {shown === "check" && <CheckStep />}
      {(shown === "run" || shown === "report") && <RunStep jobs={mine.value} />}
    </div>
  );
}

/** A job takes precedence over the draft it was started from; null while neither is known. */
function shownNow(): Shown | null {
  if (known.value === null || candidates.value.value === null) return null;
  if (jobUnderWay.value) return "run";
  if (mine.value.length > 0) return "report";
  return draft.value.step;
}

/** Steps that can be opened without a job: those of the draft reached so far. */
function reachable(step: Shown): step is Step {
  if (step === "find") return true;
  if (draft.value.chosen.length === 0) return false;
  const ready = count(draft.value).open === 0 && wanted(draft.value).length > 0;
  return step === "identify" || ((step === "profile" || step === "check") && ready);
}

function Steps({ shown }: { shown: Shown | null }) {
  const at = shown === null ? -1 : ORDER.indexOf(shown);
  const locked = shown === "run" || shown === "report";
  return (
    <nav class="wizard-steps" aria-label={words.steps}>
      <ol>
        {ORDER.map((step, place) => {
          // The Write step is complete only when the values are in ROM; with values in RAM only, the report is not, either.
          const past = place < ORDER.indexOf("run") ? at > place : shown === "report" && finished(mine.value);
          const open = !locked && place !== at && place < at && reachable(step);
          const face = (
            <>
              <span class="n">
                {past && (
                  <span class="k-ok">
                    <Icon name="tick" size={14} />
                    <span class="hidden-text">{words.stepDone}</span>
                  </span>
                )}
                {words.step(place + 1)}
              </span>
              <span class="w">{words.names[step]}</span>
            </>
          );
          return (
            <li key={step} aria-current={place === at ? "step" : undefined} class={past ? "past" : ""}>
              {open ? (
                <button
                  type="button"
                  data-testid={`go-${step}`}
                  onClick={() => changeDraft({ step: step as Step })}
                >
                  {face}
                </button>
              ) : (
                <span class="face">{face}</span>
              )}
            </li>
          );
        })}
      </ol>
    </nav>
  );
}
