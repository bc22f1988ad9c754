/** Owns what is said after a write to RAM, and taking it back: what stood there before, written again and proved. */
import { useSignal } from "@preact/signals";
import { clock } from "../form/format";
import { type AskBack, lastWritten, type Wanted, type Written, write } from "../state/apply";
import type { Sheet } from "../state/parameters";
import { text } from "../text";
import { editing } from "../text/topics";
import { Button } from "../ui/button";
import { Dialog } from "../ui/dialog";
import { BeforeAfter } from "./before-after";

const said = editing.undo;

interface Props {
  sheet: Sheet;
  name: string;
  online: boolean;
  askBack: AskBack;
}

export function UndoLine({ sheet, name, online, askBack }: Props) {
  const open = useSignal(false);
  const last = lastWritten.value;
  if (last === null || last.uid !== sheet.uid) return null;
  const { written } = last;
  const forget = () => {
    lastWritten.value = null;
  };
  return (
    <div class="undo-line small" data-testid="undo-line">
      <span role="status">{said.line(written.changes.length, clock(written.at))}</span>
      <Button
        live
        testid="undo"
        disabled={!online || sheet.busy.value !== null}
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
          written={written}
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

interface DialogProps {
  sheet: Sheet;
  name: string;
  written: Written;
  onClose: () => void;
  onGo: (values: ReadonlyMap<string, Wanted>) => void;
}

function UndoDialog({ sheet, name, written, onClose, onGo }: DialogProps) {
  const changes = written.changes.filter(one => sheet.held(one.key) !== one.before);
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
      {changes.length === 0 && <p>{said.nothing}</p>}
      {changes.length > 0 && (
        <BeforeAfter
          head={{ parameter: said.head.parameter, now: said.head.now, next: said.head.before }}
          changes={changes.map(one => ({ key: one.key, now: sheet.held(one.key), next: one.before }))}
          testid="undo"
        />
      )}
    </Dialog>
  );
}
