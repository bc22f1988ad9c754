/** The dialog of what is changed: what ROM and RAM hold, and what they will. */

import { catalog } from "../bench/catalog";
import { full } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { text } from "../text";
import { saving } from "./words";

/** The value a key will have once everything staged is applied. */
export function willBe(sheet: Sheet, key: string) {
  const draft = sheet.drafts.get(key);
  return draft?.verdict.ok ? draft.verdict.value : sheet.held(key);
}

interface DiffProps {
  sheet: Sheet;
  name: string;
  keys: readonly string[];
  onClose: () => void;
}

export function DiffDialog({ sheet, name, keys, onClose }: DiffProps) {
  return (
    <Dialog
      title={saving.diffTitle(keys.length, name)}
      testid="diff-dialog"
      onClose={onClose}
      foot={
        <span data-first-focus>
          <Button onClick={onClose}>{text.close}</Button>
        </span>
      }
    >
      <ChangeList sheet={sheet} keys={keys} />
    </Dialog>
  );
}

function ChangeList({ sheet, keys }: Pick<DiffProps, "sheet" | "keys">) {
  const head = saving.head;
  return (
    <table class="changes">
      <thead>
        <tr>
          <th>{head.parameter}</th>
          <th class="right">{head.rom}</th>
          <th class="right">{head.ram}</th>
          <th class="right">{head.after}</th>
        </tr>
      </thead>
      <tbody>
        {keys.map(key => {
          const row = catalog.value?.rows.get(key);
          const reading = sheet.reading(key).value;
          if (!row) return null;
          const span = spanOf(row, reading);
          const rom = reading?.rom ?? null;
          return (
            <tr key={key} data-testid={`change-${key}`}>
              <td>
                {row.label} <small class="second">{row.name}</small>
              </td>
              <td class="right second">{rom === null ? text.servos.notKnown : full(rom, span)} →</td>
              <td class="right second">{full(reading?.ram, span)} →</td>
              <td class="right strong k-intent">{full(willBe(sheet, key), span)}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}
