/** Copy the column of a servo to others: differences are staged, except for identity and torque mode. */
import { useSignal } from "@preact/signals";
import type { Row } from "../api/types";
import { nameOf, servo } from "../bench/fleet";
import { sheetOf } from "../bench/parameters";
import { stageValue } from "../change/stage";
import { Confirm } from "../kit/confirm";
import { inSet, Tick } from "../kit/field";
import { copyOf } from "./state";
import { matrix } from "./words";

const strings = matrix.copying;

interface Props {
  from: string;
  uids: readonly string[];
  rows: readonly Row[];
  onClose: () => void;
}

export function CopyDialog({ from, uids, rows, onClose }: Props) {
  const source = servo(from);
  const others = uids.filter(uid => uid !== from && servo(uid)?.online === true);
  const chosen = useSignal<ReadonlySet<string>>(
    new Set(others.filter(uid => servo(uid)?.model === source?.model)),
  );
  const plans = others.map(uid => ({ uid, plan: copyOf(sheetOf(from), sheetOf(uid), rows) }));
  const going = plans.filter(one => chosen.value.has(one.uid));
  const total = going.reduce((sum, one) => sum + one.plan.drafts.size, 0);
  return (
    <Confirm
      title={strings.title(nameOf(source))}
      subtitle={strings.skippedLine}
      verb={strings.go(total)}
      local
      ready={total > 0}
      testid="copy-dialog"
      actId="copy-go"
      act={() => {
        for (const { uid, plan } of going) {
          for (const [key, draft] of plan.drafts) stageValue(sheetOf(uid), key, draft);
        }
      }}
      onClose={onClose}
    >
      <fieldset class="m-who">
        <legend class="second">{strings.who}</legend>
        {plans.map(({ uid, plan }) => (
          <Tick key={uid} at={inSet(chosen, uid)} holder={`copy-to-${uid}`}>
            <span class="grow">
              {nameOf(servo(uid))}
              {servo(uid)?.model !== source?.model && <small class="dim"> {strings.otherModel}</small>}
            </span>
            <span class="small second">
              {strings.differing(plan.drafts.size)}
              {plan.left > 0 && `. ${strings.skipped(plan.left)}`}
            </span>
          </Tick>
        ))}
      </fieldset>
    </Confirm>
  );
}
