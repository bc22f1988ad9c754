/** The list of the runs of a servo, to select those that are shown. */
import { useSignal } from "@preact/signals";
import { API } from "../api/client";
import type { StepRun } from "../api/lab-types";
import { clock, date, number, signed, withUnit } from "../bench/format";
import { up } from "../bench/link";
import { verdictText } from "../bench/note-text";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { cell, Tick } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Unread } from "../kit/loaded";
import { gainsOf } from "./legend";
import { chosenRuns, dropRun, loadRuns, runs, runsProblem, toggle } from "./state";
import * as lab from "./step-runs";
import { tune as words } from "./words";

/** "14:02:31" for today, with the date for other days. */
function instant(utc: number): string {
  const day = date(utc);
  return day === date(Date.now() / 1000) ? clock(utc) : `${day} ${clock(utc)}`;
}

export function RunList({ uid }: { uid: string }) {
  const strings = words.runs;
  const dropping = useSignal<StepRun | null>(null);
  const list = runs.value;
  if (list?.length === 0 && runsProblem.value === null) return null;
  const places = new Map(chosenRuns.value.map((id, place) => [id, lab.letter(place)]));
  return (
    <section class="tune-list" aria-label={strings.title} data-testid="runs" data-uid={uid}>
      <header>
        <h2>{strings.title}</h2>
        <p class="second small">{strings.lead}</p>
      </header>
      <Unread why={runsProblem.value} sentence={strings.failed} onAgain={() => void loadRuns()} />
      {list === null && runsProblem.value === null && <p class="w-line second">{strings.loading}</p>}
      <ul>
        {(list ?? []).map(run => {
          const at = instant(run.at);
          const place = places.get(run.id);
          return (
            <li key={run.id} class="tune-run" data-testid={`run-${run.id}`} data-chosen={place !== undefined}>
              <Tick
                label={strings.show(at)}
                at={cell(place !== undefined, () => toggle(run.id))}
                testid={`tick-run-${run.id}`}
                disabled={!up.value}
              >
                <b class="tune-place">{place ?? ""}</b>
                <span class="grow">
                  <span>
                    <Glyph kind={run.verdict.level} size={13} /> {at}
                    {words.list}
                    {verdictText(run.verdict)}
                    {run.note !== "" && <span class="second"> {run.note}</span>}
                  </span>
                  <small class="second">
                    {[
                      strings.facts(withUnit(signed(run.step_deg, 1), "°"), number(run.achieved_hz, 0)),
                      gainsOf(run),
                    ]
                      .filter(Boolean)
                      .join(words.list)}
                  </small>
                </span>
              </Tick>
              <a class="button" href={`${API}/runs/${run.id}/csv`} download="" aria-label={strings.csv(at)}>
                <Icon name="download" size={15} /> {strings.csvWord}
              </a>
              <Button
                look="plain"
                testid={`drop-run-${run.id}`}
                live
                title={strings.drop(at)}
                onClick={() => {
                  dropping.value = run;
                }}
              >
                {strings.dropWord}
              </Button>
            </li>
          );
        })}
      </ul>
      {dropping.value !== null && (
        <Confirm
          title={strings.dropTitle(instant(dropping.value.at))}
          subtitle={strings.dropText}
          verb={strings.dropConfirm}
          danger
          testid="drop-run"
          actId="drop-run-confirm"
          act={() => dropRun(dropping.peek()?.id ?? 0)}
          onClose={() => {
            dropping.value = null;
          }}
        />
      )}
    </section>
  );
}
