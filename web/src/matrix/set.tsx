/** Set a row on several servos: one value, checked for each of them, staged and not sent. */
import { useSignal } from "@preact/signals";
import type { Row } from "../api/types";
import { nameOf, servo } from "../bench/fleet";
import { full } from "../bench/format";
import { sheetOf } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { draftFor, numberFor, stageValue } from "../change/stage";
import { Confirm } from "../kit/confirm";
import { Choice, inSet, negated, TextField, Tick } from "../kit/field";
import { optionsOf } from "./state";
import { matrix } from "./words";

const strings = matrix.set;

interface Props {
  uids: readonly string[];
  row: Row;
  onClose: () => void;
}

export function SetDialog({ uids, row, onClose }: Props) {
  const typed = useSignal("");
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
    // The same number in degrees and in rpm differs.
    const plan =
      wanted === null ? null : span.unit === unit ? draftFor(sheet, row, wanted) : { why: span.unit };
    return { uid, sheet, span, plan };
  });
  const going = plans.flatMap(one =>
    one.plan !== null && !("why" in one.plan) && !left.value.has(one.uid) ? [{ ...one, plan: one.plan }] : [],
  );
  return (
    <Confirm
      title={strings.title(row.label)}
      subtitle={strings.line}
      verb={strings.go(going.length)}
      local
      ready={going.length > 0}
      testid="set-dialog"
      actId="set-go"
      act={() => {
        for (const one of going) stageValue(one.sheet, row.key, one.plan);
      }}
      onClose={onClose}
    >
      <div data-first-focus>
        {row.kind === "number" ? (
          <TextField label={strings.value} at={typed} number unit={unit} beside short testid="set-value" />
        ) : (
          <Choice
            label={strings.value}
            at={typed}
            beside
            testid="set-value"
            options={[{ key: "", label: strings.choose }, ...optionsOf(row)]}
          />
        )}
      </div>
      <fieldset class="m-who">
        <legend class="second">{strings.who}</legend>
        {plans.map(({ uid, sheet, span, plan }) => (
          <Tick key={uid} at={negated(inSet(left, uid))}>
            <span class="grow">{nameOf(servo(uid))}</span>
            <span class={plan !== null && "why" in plan ? "small k-failure" : "small second"}>
              {plan !== null && "why" in plan
                ? strings.refused(plan.why || matrix.absent)
                : strings.now(full(sheet.held(row.key), span))}
            </span>
          </Tick>
        ))}
      </fieldset>
    </Confirm>
  );
}
