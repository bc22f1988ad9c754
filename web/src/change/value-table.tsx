/** The table of values of rows: what they are, and what they will be. */
import type { Profile } from "../api/config-types";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { DataTable } from "../kit/data-table";

export interface ValueRow {
  key: string;
  /** A column each; the last is what it will be. */
  values: readonly string[];
  note?: string | false | undefined;
}

interface Props {
  /** Of the rows, and of each value. */
  heads: readonly [rows: string, ...values: string[]];
  rows: readonly ValueRow[];
  testid?: string;
}

export function ValueTable({ heads: [label, ...heads], rows, testid }: Props) {
  const last = heads.length - 1;
  return (
    <DataTable
      small
      label={label}
      rows={rows}
      id={one => one.key}
      data={one => ({ testid: testid && `${testid}-${one.key}` })}
      columns={[
        {
          key: "parameter",
          head: label,
          cell: ({ key, note }) => (
            <>
              {rowLabelOf(key)} <small class="second">{addressOf(key)}</small>
              {note && <small class="under">{note}</small>}
            </>
          ),
        },
        ...heads.map((head, place) => ({
          key: head,
          head,
          right: true,
          look: () => (last === 0 ? "" : place < last ? "second" : "strong k-intent"),
          cell: ({ values }: ValueRow) => values[place] + (place < last ? " →" : ""),
        })),
      ]}
    />
  );
}

interface ProfileProps {
  one: Profile;
  head: { parameter: string; value: string };
}

/** What a profile sets. */
export function ProfileValues({ one, head }: ProfileProps) {
  const rows = Object.entries(one.values).map(([key, value]) => ({
    key,
    values: [valueText(key, value, one.units[key] ?? "")],
  }));
  return <ValueTable heads={[head.parameter, head.value]} rows={rows} />;
}
