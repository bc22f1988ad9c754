/** A plan: the changed rows of each servo, skipped rows and excluded servos with reasons. */
import { nameOf, servo } from "../bench/fleet";
import { rowLabelOf, valueText } from "../bench/row-text";
import { Note } from "../kit/note";
import { whyRefused } from "./consequences";
import type { ChangeFlow, ChangeKind, Part, RowChange } from "./flow";
import { type ValueRow, ValueTable } from "./value-table";
import { saving, changing as strings } from "./words";

export function PlanParts({ flow }: { flow: ChangeFlow }) {
  const parts = flow.parts.value ?? [];
  const { kind } = flow.request;
  if (["output", "profile", "plan", "plan-resume"].includes(kind)) return null;
  if (parts.length === 0) return flow.problem.value ? null : <p>{wordsOfNothing(kind)}</p>;
  const [alone] = parts;
  if (alone && parts.length === 1 && !kind.startsWith("batch")) return <PlanRows part={alone} kind={kind} />;
  return (
    <>
      {parts.map(part => (
        <section
          key={part.uid}
          class="planned"
          data-testid={`${kind}-${part.uid}`}
          data-outcome={part.problem ? "rejected" : "planned"}
        >
          <h3>
            {nameOf(servo(part.uid))} <small class="second">{servo(part.uid)?.model}</small>
          </h3>
          {part.problem ? (
            <Note>{strings.rejected(whyRefused(part.problem))}</Note>
          ) : (
            <PlanRows part={part} kind={kind} />
          )}
        </section>
      ))}
    </>
  );
}

const wordsOfNothing = (kind: ChangeKind) => strings.kinds[kind].nothing ?? strings.nothing;

function PlanRows({ part, kind }: { part: Part; kind: ChangeKind }) {
  const { changes, rom = [], unchanged = 0, unknown = 0, leftOut = [], problem } = part;
  const head = { now: strings.now, next: strings.next, ...strings.kinds[kind].head };
  const many = kind === "factory-reset" && changes.length > 6;
  const table = (
    <ValueTable heads={[strings.parameter, head.now, head.next]} rows={rowsOf(changes)} testid={kind} />
  );
  return (
    <>
      {problem && <Note>{whyRefused(problem)}</Note>}
      {!problem && changes.length + rom.length === 0 && (
        <p data-testid="nothing-changes">{wordsOfNothing(kind)}</p>
      )}
      {kind === "restart" && changes.length > 0 && (
        <p data-testid="lost">
          <b>{strings.lost(changes.length)}.</b> <span class="second">{strings.lostHint}</span>
        </p>
      )}
      {changes.length > 0 &&
        (many ? (
          <details>
            <summary data-testid="reset-count">{strings.reset.changes(changes.length)}</summary>
            {table}
          </details>
        ) : (
          table
        ))}
      {changes.length > 0 && unchanged > 0 && <p class="small dim">{strings.unchanged(unchanged)}</p>}
      {leftOut.length > 0 && (
        <details>
          <summary>{strings.leftOut(leftOut.length)}</summary>
          <ul class="left-out">
            {leftOut.map(one => (
              <li key={one.key}>
                {rowLabelOf(one.key)}: <span class="second">{one.why}</span>
              </li>
            ))}
          </ul>
        </details>
      )}
      {rom.length > 0 && (
        <ValueTable
          heads={[strings.parameter, saving.head.rom, saving.head.after]}
          rows={rowsOf(rom)}
          testid={kind === "save" ? "save" : "rom"}
        />
      )}
      {unknown > 0 && <p class="small second">{saving.unknownRows(unknown)}</p>}
    </>
  );
}

function rowsOf(changes: readonly RowChange[]): ValueRow[] {
  return changes.map(({ key, now, next, doubt }) => ({
    key,
    values: [valueText(key, now), valueText(key, next)],
    note: doubt && strings.assumed,
  }));
}
