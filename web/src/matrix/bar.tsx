/** The bar of the matrix: staged changes and servos, and its buttons. */

import { all } from "../bench/fleet";
import { up } from "../bench/link";
import { sheetOf } from "../bench/parameters";
import { observing } from "../bench/role";
import { underWay } from "../change/flow";
import { stagedOn } from "../change/requests";
import { actionWords } from "../change/words";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { useKeys } from "../kit/use-keys";
import { wrongOn } from "./state";
import { matrix } from "./words";

const strings = matrix.bar;

interface Props {
  uids: readonly string[];
  /** Why the last action was refused. */
  problem: string | null;
  onReview: () => void;
  onSave: () => void;
}

export function MatrixBar({ uids, problem, onReview, onSave }: Props) {
  const values = stagedOn(uids);
  const count = [...values.values()].reduce((sum, one) => sum + one.size, 0);
  const bad = wrongOn(uids);
  const unsaved = all.value.filter(one => uids.includes(one.uid) && one.unsaved.length > 0);
  const ramOnly = unsaved.reduce((sum, one) => sum + one.unsaved.length, 0);
  const savable = unsaved.filter(one => one.online).length;
  // As observer staged values remain, to be applied in another role.
  const may = up.value && !observing.value;
  const busy = underWay([...values.keys(), ...unsaved.map(one => one.uid)]);
  const mayReview = may && !busy && count > 0;
  const maySave = may && !busy && savable > 0 && count === 0;
  useKeys({
    "Ctrl+Enter": () => mayReview && onReview(),
    // Staged changes go through the review, which offers a save.
    "Ctrl+S": () => (maySave ? onSave() : mayReview && onReview()),
  });
  if (count + bad + ramOnly === 0 || (observing.value && count + bad === 0)) return null;
  const nothing = count + bad === 0;
  const label = nothing ? strings.ramOnly(ramOnly) : strings.label(count, values.size);
  return (
    <section class="save-bar" data-testid="matrix-bar" aria-label={label}>
      <div class="said">
        <p class="headline">
          {label}
          {bad > 0 && <span class="k-failure plain">, {strings.wrong(bad)}</span>}
        </p>
        {problem !== null && (
          <p class="problem small" role="alert" data-testid="matrix-refused">
            <Glyph kind="failure" size={13} /> {problem}
          </p>
        )}
        <p class="second small">
          {nothing ? strings.ramLine : ramOnly > 0 && `${strings.ramOnly(ramOnly)}. `}
          {bad > 0 && strings.never}
        </p>
      </div>
      <Button
        look="plain"
        testid="matrix-discard"
        disabled={nothing}
        onClick={() => {
          for (const uid of uids) {
            const sheet = sheetOf(uid);
            sheet.drafts.clear();
            sheet.setOutcomes([...sheet.outcomes.peek().keys()].map(key => [key, null]));
          }
        }}
      >
        {strings.discard}
      </Button>
      <Button look="two" testid="matrix-save" live disabled={!maySave} onClick={onSave}>
        {strings.save}
        <small>{busy ? actionWords.underWay(2) : strings.saveSub(savable)}</small>
      </Button>
      <Button look="two primary" testid="matrix-review" live disabled={!mayReview} onClick={onReview}>
        {strings.review}
        <small>{busy ? actionWords.underWay(2) : strings.reviewSub}</small>
      </Button>
    </section>
  );
}
