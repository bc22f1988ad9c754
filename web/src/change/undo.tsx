/** The line after a write to RAM, and undo: the values before, written again and verified. */
import { useEffect } from "preact/hooks";
import type { KnownServo } from "../bench/fleet";
import { clock } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { Button } from "../kit/button";
import { restartedSince, undoable, undoChange } from "./apply";
import { beginChange, underWay } from "./flow";
import { editing } from "./words";

const strings = editing.undo;

interface Props {
  sheet: Sheet;
  one: KnownServo;
}

export function UndoLine({ sheet, one }: Props) {
  const written = sheet.written.value;
  const over = written !== null && restartedSince(written, one);
  const forget = () => {
    sheet.written.value = null;
  };
  const undo = async () => {
    sheet.trouble.value = await beginChange(undoChange(sheet, changes));
  };
  useEffect(() => {
    if (over) forget();
  }, [over]);
  const changes = written === null || over ? [] : undoable(written, sheet);
  if (written === null || changes.length === 0) return null;
  return (
    <div class="undo-line small" data-testid="undo-line">
      <span role="status">{strings.line(changes.length, clock(written.at))}</span>
      <Button
        live
        testid="undo"
        disabled={!one.online || sheet.busy.value !== null || underWay([one.uid])}
        onClick={() => void undo()}
      >
        {strings.open}
      </Button>
      <Button look="plain" onClick={forget}>
        {strings.dismiss}
      </Button>
    </div>
  );
}
