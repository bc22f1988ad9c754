/** The runs of a servo: those laid over one another, and the list to choose from. */
import { useSignal } from "@preact/signals";
import { API } from "../api/client";
import type { StepRun } from "../api/lab-types";
import { clock, date, number, signed, withUnit } from "../bench/format";
import { up } from "../bench/link";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { text } from "../text";
import { tune as words } from "../text/topics";
import { Metrics } from "./metrics";
import { gainsOf, ms, StepPlotPanel } from "./plot";
import { chosenRuns, dropRun, loadRuns, overlay, runs, runsProblem, testing, toggle } from "./state";
import * as lab from "./step-runs";

export function TuneRuns({ uid }: { uid: string }) {
  const direction = useSignal<lab.Direction>("there");
  const list = runs.value;
  const shown = overlay.value;
  if (list?.length === 0) {
    if (testing.value) return null;
    return (
      <section class="w-empty" aria-label={words.runs.title} data-testid="no-runs">
        <p class="strong">{words.runs.none}</p>
        <p class="second">{words.runs.noneLine}</p>
      </section>
    );
  }
  return (
    <>
      {shown && shown.runs.length > 0 && (
        <>
          <StepPlotPanel runs={shown.runs} direction={direction} />
          <Metrics runs={shown.runs} differences={shown.differences} direction={direction.value} />
        </>
      )}
      <RunList uid={uid} />
    </>
  );
}

/** "14:02:31" of today, with its day of another. */
function instant(utc: number): string {
  const day = date(utc);
  return day === date(Date.now() / 1000) ? clock(utc) : `${day} ${clock(utc)}`;
}

function RunList({ uid }: { uid: string }) {
  const said = words.runs;
  const dropping = useSignal<StepRun | null>(null);
  const why = useSignal<string | null>(null);
  const list = runs.value;
  const places = new Map(chosenRuns.value.map((id, place) => [id, lab.letter(place)]));
  return (
    <section class="tune-list" aria-label={said.title} data-testid="runs" data-uid={uid}>
      <header>
        <h2>{said.title}</h2>
        <p class="second small">{said.lead}</p>
      </header>
      {runsProblem.value !== null && (
        <div class="c-note bad" role="alert">
          <Glyph kind="failure" />
          <p class="grow">{said.failed(runsProblem.value)}</p>
          <Button live onClick={() => void loadRuns()}>
            {said.again}
          </Button>
        </div>
      )}
      {list === null && runsProblem.value === null && <p class="w-line second">{said.loading}</p>}
      <ul>
        {(list ?? []).map(run => {
          const at = instant(run.at);
          const place = places.get(run.id);
          const settled = lab.figure(run, "there", "settling_s");
          return (
            <li key={run.id} class="tune-run" data-testid={`run-${run.id}`} data-chosen={place !== undefined}>
              <label>
                <input
                  type="checkbox"
                  data-testid={`tick-run-${run.id}`}
                  checked={place !== undefined}
                  aria-label={said.show(at)}
                  disabled={!up.value}
                  onChange={() => toggle(run.id)}
                />
                <b class="tune-place">{place ?? ""}</b>
                <span class="grow">
                  <span>
                    {at}, {run.note === "" ? <span class="second">{said.noNote}</span> : run.note}
                  </span>
                  <small class="second">
                    {[
                      said.facts(withUnit(signed(run.step_deg, 1), "°"), number(run.achieved_hz, 0)),
                      gainsOf(run),
                      settled ? `${said.head.settled} ${ms(settled.value)}` : said.unsettled,
                    ]
                      .filter(Boolean)
                      .join(", ")}
                  </small>
                </span>
              </label>
              <a class="button" href={`${API}/runs/${run.id}/csv`} download="" aria-label={said.csv(at)}>
                <Icon name="download" size={15} /> {said.csvWord}
              </a>
              <Button
                look="plain"
                testid={`drop-run-${run.id}`}
                live
                title={said.drop(at)}
                onClick={() => {
                  why.value = null;
                  dropping.value = run;
                }}
              >
                {said.dropWord}
              </Button>
            </li>
          );
        })}
      </ul>
      {dropping.value !== null && (
        <Dialog
          title={said.dropTitle(instant(dropping.value.at))}
          subtitle={said.dropText}
          testid="drop-run"
          onClose={() => {
            dropping.value = null;
          }}
          foot={
            <>
              <span data-first-focus>
                <Button
                  onClick={() => {
                    dropping.value = null;
                  }}
                >
                  {text.cancel}
                </Button>
              </span>
              <span class="grow" />
              <Button
                look="danger"
                live
                testid="drop-run-confirm"
                onClick={() => {
                  const run = dropping.peek();
                  if (!run) return;
                  void dropRun(run.id).then(problem => {
                    why.value = problem;
                    if (problem === null) dropping.value = null;
                  });
                }}
              >
                {said.dropConfirm}
              </Button>
            </>
          }
        >
          {why.value !== null && (
            <p class="refusal" role="alert">
              <Glyph kind="failure" size={14} /> {why.value}
            </p>
          )}
        </Dialog>
      )}
    </section>
  );
}
