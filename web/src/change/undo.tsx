/** What is said after a write to RAM, and taking it back: what stood there before, written again and proved. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Change } from "../api/types";
import type { KnownServo } from "../bench/fleet";
import { clock } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { text } from "../text";
import { editing } from "../text/topics";
import { type AskBack, lastWritten, restartedSince, undoable, type WantedValue, write } from "./apply";
import { BeforeAfter } from "./before-after";

const said = editing.undo;

interface Props {
  sheet: Sheet;
  one: KnownServo;
  name: string;
  askBack: AskBack;
}

export function UndoLine({ sheet, one, name, askBack }: Props) {
  const open = useSignal(false);
  const last = lastWritten.value;
  const written = last?.uid === sheet.uid ? last.written : null;
  const over = written !== null && restartedSince(written, one);
  useEffect(() => {
    if (over) forget();
  }, [over]);
  const changes = written === null || over ? [] : undoable(written, sheet);
  if (written === null || changes.length === 0) return null;
  return (
    <div class="undo-line small" data-testid="undo-line">
      <span role="status">{said.line(changes.length, clock(written.at))}</span>
      <Button
        live
        testid="undo"
        disabled={!one.online || sheet.busy.value !== null}
        onClick={() => {
          open.value = true;
        }}
      >
        {said.open}
      </Button>
      <Button look="plain" onClick={forget}>
        {said.dismiss}
      </Button>
      {open.value && (
        <UndoDialog
          sheet={sheet}
          name={name}
          changes={changes}
          onClose={() => {
            open.value = false;
          }}
          onGo={values => {
            open.value = false;
            // What is staged over it would be applied with the next press, and undo the undo.
            sheet.drafts.drop(values.keys());
            void write(sheet, values, { askBack }).then(well => {
              if (well) forget();
            });
          }}
        />
      )}
    </div>
  );
}

function forget(): void {
  lastWritten.value = null;
}

interface DialogProps {
  sheet: Sheet;
  name: string;
  changes: readonly Change[];
  onClose: () => void;
  onGo: (values: ReadonlyMap<string, WantedValue>) => void;
}

function UndoDialog({ sheet, name, changes, onClose, onGo }: DialogProps) {
  const values = new Map(
    changes.flatMap(one => (one.before === null ? [] : [[one.key, one.before] as const])),
  );
  return (
    <Dialog
      title={said.title(changes.length, name)}
      subtitle={said.lead}
      testid="undo-dialog"
      onClose={onClose}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={onClose}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="undo-go"
            disabled={values.size === 0}
            onClick={() => onGo(values)}
          >
            {said.go(values.size)}
          </Button>
        </>
      }
    >
      <BeforeAfter
        head={{ parameter: said.head.parameter, now: said.head.now, next: said.head.before }}
        changes={changes.map(one => ({ key: one.key, now: sheet.held(one.key), next: one.before }))}
        testid="undo"
      />
    </Dialog>
  );
}
