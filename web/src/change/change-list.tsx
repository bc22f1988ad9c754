/** The list of changes: what ROM and RAM hold, and what they will. */

import { catalog } from "../bench/catalog";
import { full } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { text } from "../text";

/** The value a key will have once everything staged is applied. */
export function willBe(sheet: Sheet, key: string) {
  const draft = sheet.drafts.get(key);
  return draft?.verdict.ok ? draft.verdict.value : willSave(sheet, key);
}

/** The value a save puts into ROM where nothing is staged. */
export function willSave(sheet: Sheet, key: string) {
  return sheet.held(key);
}

interface Props {
  sheet: Sheet;
  keys: readonly string[];
  /** The dialog before a save compares ROM with what comes; the diff shows RAM too. */
  withRam?: boolean;
}

export function ChangeList({ sheet, keys, withRam = false }: Props) {
  const head = text.save.head;
  return (
    <table class="changes">
      <thead>
        <tr>
          <th>{head.parameter}</th>
          <th class="right">{head.rom}</th>
          {withRam && <th class="right">{head.ram}</th>}
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
              {withRam && <td class="right second">{full(reading?.ram, span)} →</td>}
              <td class="right strong k-intent">{full(willBe(sheet, key), span)}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}
