/** One servo in the dialog of a batch: what is planned for it, and what became of it. */
import type { BatchOutcome } from "../api/config-types";
import { nameOf, servo } from "../bench/fleet";
import { asProblem, sheetOf } from "../bench/parameters";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { matrix } from "../text/topics";
import { changed } from "./batch";
import { whyRefused } from "./consequences";

const said = matrix.plan;

export interface Result {
  state: "working" | "ok" | "failure";
  text: string;
}

/** With `save`, the rows that ROM will hold differently; else those that RAM will. */
export function PlannedServo({ one, save }: { one: BatchOutcome; save: boolean }) {
  const changes = save
    ? (one.rom_changes ?? []).map(({ key, before, after }) => ({ key, before, requested: after }))
    : changed(one.changes);
  const unit = (key: string) => sheetOf(one.uid).reading(key).value?.unit;
  return (
    <section class="m-planned" data-testid={`plan-${one.uid}`} data-outcome={one.outcome}>
      <h3>
        {nameOf(servo(one.uid))} <small class="second">{servo(one.uid)?.model}</small>
      </h3>
      {one.problem && (
        <p class="refusal">
          <Glyph kind="failure" size={14} /> {said.rejected(whyRefused(asProblem(one.problem)))}
        </p>
      )}
      {!one.problem && changes.length === 0 && <p class="second">{said.nothing}</p>}
      {changes.length > 0 && (
        <table class="changes">
          <thead class="hidden-head">
            <tr>
              <th>{said.head.parameter}</th>
              <th class="right">{save ? text.save.head.rom : said.head.now}</th>
              <th class="right">{save ? text.save.head.after : said.head.target}</th>
            </tr>
          </thead>
          <tbody>
            {changes.map(change => (
              <tr key={change.key}>
                <td>
                  {rowLabelOf(change.key)} <small class="second">{addressOf(change.key)}</small>
                </td>
                <td class="right second">{valueText(change.key, change.before, unit(change.key))} →</td>
                <td class="right strong k-intent">
                  {valueText(change.key, change.requested, unit(change.key))}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

interface LineProps {
  uid: string;
  result: Result | undefined;
  plan: readonly BatchOutcome[];
}

export function ResultLine({ uid, result, plan }: LineProps) {
  const left = plan.find(one => one.uid === uid && one.outcome === "rejected");
  const shown: Result =
    result ??
    (left
      ? { state: "failure", text: said.rejected(left.problem ? whyRefused(asProblem(left.problem)) : "") }
      : { state: "working", text: said.working });
  return (
    <li data-testid={`result-${uid}`} data-state={shown.state}>
      {shown.state === "working" ? (
        <span class="k-intent">
          <Spinner />
        </span>
      ) : (
        <Glyph kind={shown.state} />
      )}
      <span>
        <b>{nameOf(servo(uid))}</b>
        <small class="second">{shown.text}</small>
      </span>
    </li>
  );
}
