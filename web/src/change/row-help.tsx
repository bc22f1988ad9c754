/** Help under a row: description, section, register, raw value, range and step. */
import type { Row } from "../api/types";
import { catalog } from "../bench/catalog";
import { now } from "../bench/clock";
import { age, full, unbroken } from "../bench/format";
import type { KnownReading } from "../bench/parameters";
import { aboutRow, adviceOn } from "../bench/row-help";
import type { spanOf } from "../bench/row-state";
import { editing } from "./words";

const strings = editing.help;

interface Props {
  row: Row;
  span: ReturnType<typeof spanOf>;
  reading: KnownReading | undefined;
}

export function Help({ row, span, reading }: Props) {
  const ranged = span.minimum !== null && span.maximum !== null && row.kind === "number";
  const follows = row.unit_when ? catalog.value?.rows.get(row.unit_when.parameter) : undefined;
  const extra = [
    adviceOn(row),
    row.after_restart ? strings.afterRestart : "",
    follows ? strings.unitFollows(`${follows.label} (${follows.name})`) : "",
  ].filter(Boolean);
  return (
    <div role="cell" class="p-help" id={`help-${row.key}`}>
      <p>{unbroken(aboutRow(row))}</p>
      {extra.map(line => (
        <p key={line} class="second">
          {unbroken(line)}
        </p>
      ))}
      <dl class="small">
        <Fact term={strings.register}>
          <span class="mono">{strings.address(row.name, row.address)}</span>, {strings.section(row.section)}
        </Fact>
        <Fact term={strings.raw}>
          <span class="mono" data-testid={`raw-${row.key}`}>
            {reading?.raw ?? strings.unread}
          </span>
          {reading?.readAt != null && (
            <> ({strings.readAgo(age(Math.max(0, now.value - reading.readAt), 0))})</>
          )}
        </Fact>
        {ranged && (
          <Fact term={strings.range}>
            {strings.rangeOf(full(span.minimum, span), full(span.maximum, span))}
          </Fact>
        )}
        {row.kind === "number" && row.access === "rw" && (
          <Fact term={strings.step}>{full(1 / span.perUnit, span)}</Fact>
        )}
        {row.access !== "r" && <Fact term={strings.standard}>{full(reading?.default, span)}</Fact>}
      </dl>
      {row.kind === "number" && row.access === "rw" && <p class="small dim touch-hide">{strings.keys}</p>}
    </div>
  );
}

function Fact({ term, children }: { term: string; children: preact.ComponentChildren }) {
  return (
    <div>
      <dt>{term}</dt>
      <dd>{children}</dd>
    </div>
  );
}
