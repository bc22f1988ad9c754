/** The dialog of changes: values in ROM and RAM, and after. */

import { catalog } from "../bench/catalog";
import { full } from "../bench/format";
import type { Sheet } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { Dialog } from "../kit/dialog";
import { text } from "../text";
import { ValueTable } from "./value-table";
import { saving } from "./words";

/** Value of a key after all staged edits are applied. */
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
    <Dialog title={saving.diffTitle(keys.length, name)} testid="diff-dialog" onClose={onClose}>
      <ChangeList sheet={sheet} keys={keys} />
    </Dialog>
  );
}

function ChangeList({ sheet, keys }: Pick<DiffProps, "sheet" | "keys">) {
  const { parameter, rom, ram, after } = saving.head;
  const rows = keys.flatMap(key => {
    const row = catalog.value?.rows.get(key);
    const reading = sheet.reading(key).value;
    if (!row) return [];
    const span = spanOf(row, reading);
    const saved = reading?.rom == null ? text.servos.notKnown : full(reading.rom, span);
    return [{ key, values: [saved, full(reading?.ram, span), full(willBe(sheet, key), span)] }];
  });
  return <ValueTable testid="change" heads={[parameter, rom, ram, after]} rows={rows} />;
}
