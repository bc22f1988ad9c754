/** Current state of a servo's row: value, draft, and the state of both. */
import type { Row } from "../api/types";
import { now } from "../bench/clock";
import { servo } from "../bench/fleet";
import { up } from "../bench/link";
import type { Sheet } from "../bench/parameters";
import { spanOf, viewOf } from "../bench/row-state";

export function rowView(sheet: Sheet, row: Row) {
  const reading = sheet.reading(row.key).value;
  const draft = sheet.drafts.get(row.key);
  const outcome = sheet.outcomes.value.get(row.key);
  const one = servo(sheet.uid);
  const unsaved = one?.unsaved.includes(row.key) ?? false;
  const reachable = up.value && one?.online === true;
  const view = viewOf({ row, reading, draft, outcome, unsaved, reachable, now: () => now.value });
  return { reading, draft, outcome, one, unsaved, view, span: spanOf(row, reading) };
}
