/** Whether changes reach the database that the benches share. */

import { findings } from "../bench/doctor";
import { clock } from "../bench/format";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { site as words } from "./words";

const database = () => findings.value.find(one => one.code === "database");

const figure = (name: string): number => {
  const value = database()?.params[name];
  return typeof value === "number" ? value : 0;
};

/** Beside the title: writes that wait for the database. */
export function DatabaseState() {
  if (database()?.severity !== "ok") return null;
  return (
    <span class="site-database" data-testid="database">
      <Glyph kind="ok" size={14} />
      <small>{words.database.waiting(figure("pending"))}</small>
    </span>
  );
}

/** What still works while the database does not respond. */
export function DatabaseNote() {
  const found = database();
  if (found === undefined || found.severity === "ok") return null;
  const since = clock(Date.now() / 1000 - figure("failing_s"));
  return (
    <Note band testid="database-away">
      {words.database.away(since, figure("pending"))}
    </Note>
  );
}
