/** A line with the RAM values lost in a restart, and a button to stage them again. */

import { useSignal } from "@preact/signals";
import { problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import type { KnownServo } from "../bench/fleet";
import { clock } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { rowLabelOf } from "../bench/row-text";
import { editing } from "../change/words";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { dismiss, stageAgain, stageable } from "./lost";

const strings = editing.lost;

export function LostLine({ sheet, one }: { sheet: Sheet; one: KnownServo }) {
  const problem = useSignal<string | null>(null);
  const lost = one.lost ?? [];
  if (lost.length === 0) return null;
  const left = stageable(sheet, lost);
  const names = lost.map(each => rowLabelOf(each.key)).join(", ");
  const forget = () => {
    problem.value = null;
    dismiss(one.uid).catch(error => {
      problem.value = problemText(problemOf(error));
    });
  };
  return (
    <div class="undo-line lost-line small" data-testid="lost-line">
      <Glyph kind="warning" size={16} />
      <span role="alert">
        <b>{strings.line(lost.length, clock(lost[0]?.at ?? 0))}</b> <span class="second">{names}.</span>
        {problem.value !== null && <span class="k-failure strong"> {problem.value}</span>}
      </span>
      <Button
        testid="stage-again"
        disabled={left.length === 0 || sheet.busy.value !== null}
        onClick={() => stageAgain(sheet, left)}
      >
        {left.length === 0 ? strings.staged : strings.stage(left.length)}
      </Button>
      <Button look="plain" live testid="lost-dismiss" onClick={forget}>
        {editing.undo.dismiss}
      </Button>
    </div>
  );
}
