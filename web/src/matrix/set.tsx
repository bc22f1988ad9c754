/** Set a row on all servos: one value, judged by what each of them allows, staged and not sent. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Row } from "../api/types";
import { nameOf, servo } from "../bench/fleet";
import { full } from "../bench/format";
import { sheetOf } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { draftFor, numberFor, stageValue } from "../change/stage";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { text } from "../text";
import { matrix } from "../text/topics";

const said = matrix.set;

interface Props {
  uids: readonly string[];
  row: Row;
  onClose: () => void;
}

export function SetDialog({ uids, row, onClose }: Props) {
  const typed = useSignal("");
  useEffect(() => document.getElementById("set-value")?.focus(), []);
  const able = uids.filter(
    uid => servo(uid)?.online === true && (sheetOf(uid).keys.value?.includes(row.key) ?? false),
  );
  const left = useSignal<ReadonlySet<string>>(new Set());
  const first = sheetOf(able[0] ?? "");
  const unit = spanOf(row, first.reading(row.key).value).unit;
  const value = row.kind === "number" ? numberFor(first, row, typed.value) : typed.value || null;
  const wanted = value === null ? null : row.kind === "switch" ? value === "true" : value;
  const plans = able.map(uid => {
    const sheet = sheetOf(uid);
    const span = spanOf(row, sheet.reading(row.key).value);
    // The same number in degrees and in rpm is not the same.
    const plan =
      wanted === null ? null : span.unit === unit ? draftFor(sheet, row, wanted) : { why: span.unit };
    return { uid, sheet, span, plan };
  });
  const going = plans.flatMap(one =>
    one.plan !== null && !("why" in one.plan) && !left.value.has(one.uid) ? [{ ...one, plan: one.plan }] : [],
  );
  const go = () => {
    for (const one of going) stageValue(one.sheet, row.key, one.plan);
    onClose();
  };
  return (
    <Dialog
      title={said.title(row.label)}
      subtitle={said.line}
      testid="set-dialog"
      onClose={onClose}
      foot={
        <>
          <Button onClick={onClose}>{text.cancel}</Button>
          <Button look="primary" testid="set-go" disabled={going.length === 0} onClick={go}>
            {said.go(going.length)}
          </Button>
        </>
      }
    >
      <div class="m-field">
        <label for="set-value">{said.value}</label>
        {row.kind === "number" ? (
          <span class="box">
            <input
              id="set-value"
              type="text"
              inputMode="decimal"
              autocomplete="off"
              data-testid="set-value"
              value={typed.value}
              onInput={event => {
                typed.value = event.currentTarget.value;
              }}
              onKeyDown={event => {
                if (event.key === "Enter" && going.length > 0) go();
              }}
            />
            <span class="unit">{unit}</span>
          </span>
        ) : (
          <select
            id="set-value"
            class="field"
            data-testid="set-value"
            value={typed.value}
            onChange={event => {
              typed.value = event.currentTarget.value;
            }}
          >
            <option value="">{said.choose}</option>
            {(row.kind === "switch"
              ? [
                  { key: "true", label: text.on },
                  { key: "false", label: text.off },
                ]
              : row.choices
            ).map(one => (
              <option key={one.key} value={one.key}>
                {one.label}
              </option>
            ))}
          </select>
        )}
      </div>
      <fieldset class="m-who">
        <legend class="second">{said.who}</legend>
        {plans.map(({ uid, sheet, span, plan }) => (
          <label key={uid} class="tick">
            <input
              type="checkbox"
              checked={!left.value.has(uid)}
              onChange={event => {
                const next = new Set(left.peek());
                if (event.currentTarget.checked) next.delete(uid);
                else next.add(uid);
                left.value = next;
              }}
            />
            <span class="grow">{nameOf(servo(uid))}</span>
            <span class={plan !== null && "why" in plan ? "small k-failure" : "small second"}>
              {plan !== null && "why" in plan
                ? said.refused(plan.why || matrix.absent)
                : said.now(full(sheet.held(row.key), span))}
            </span>
          </label>
        ))}
      </fieldset>
    </Dialog>
  );
}
