/** What a plan shows: of each servo the rows that change, why some do not, and why one is left out. */
import { nameOf, servo } from "../bench/fleet";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { Note } from "../kit/note";
import { whyRefused } from "./consequences";
import type { ChangeFlow, ChangeKind, Part, RowChange } from "./flow";
import { changing as said, saving } from "./words";

export function PlanParts({ flow }: { flow: ChangeFlow }) {
  const parts = flow.parts.value ?? [];
  const { kind } = flow.request;
  if (kind === "output" || kind === "profile") return null;
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
            <Note>{said.rejected(whyRefused(part.problem))}</Note>
          ) : (
            <PlanRows part={part} kind={kind} />
          )}
        </section>
      ))}
    </>
  );
}

const wordsOfNothing = (kind: ChangeKind) => said.kinds[kind].nothing ?? said.nothing;

function PlanRows({ part, kind }: { part: Part; kind: ChangeKind }) {
  const { changes, rom = [], unchanged = 0, unknown = 0, leftOut = [], problem } = part;
  const head = { now: said.now, next: said.next, ...said.kinds[kind].head };
  const many = kind === "factory-reset" && changes.length > 6;
  const table = <Rows changes={changes} head={head} testid={kind} />;
  return (
    <>
      {problem && <Note>{whyRefused(problem)}</Note>}
      {!problem && changes.length + rom.length === 0 && (
        <p data-testid="nothing-changes">{wordsOfNothing(kind)}</p>
      )}
      {kind === "restart" && changes.length > 0 && (
        <p data-testid="lost">
          <b>{said.lost(changes.length)}.</b> <span class="second">{said.lostHint}</span>
        </p>
      )}
      {changes.length > 0 &&
        (many ? (
          <details>
            <summary data-testid="reset-count">{said.reset.changes(changes.length)}</summary>
            {table}
          </details>
        ) : (
          table
        ))}
      {changes.length > 0 && unchanged > 0 && <p class="small dim">{said.unchanged(unchanged)}</p>}
      {leftOut.length > 0 && (
        <details>
          <summary>{said.leftOut(leftOut.length)}</summary>
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
        <Rows
          changes={rom}
          head={{ now: saving.head.rom, next: saving.head.after }}
          testid={kind === "save" ? "save" : "rom"}
        />
      )}
      {unknown > 0 && <p class="small second">{saving.unknownRows(unknown)}</p>}
    </>
  );
}

interface RowsProps {
  changes: readonly RowChange[];
  head: { now: string; next: string };
  testid: string;
}

function Rows({ changes, head, testid }: RowsProps) {
  return (
    <table class="changes">
      <thead>
        <tr>
          <th>{said.parameter}</th>
          <th class="right">{head.now}</th>
          <th class="right">{head.next}</th>
        </tr>
      </thead>
      <tbody>
        {changes.map(one => (
          <tr key={one.key} data-testid={`${testid}-${one.key}`}>
            <td>
              {rowLabelOf(one.key)} <small class="second">{addressOf(one.key)}</small>
              {one.doubt && <small class="under">{said.assumed}</small>}
            </td>
            <td class="right second">{valueText(one.key, one.now)} →</td>
            <td class="right strong k-intent">{valueText(one.key, one.next)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
