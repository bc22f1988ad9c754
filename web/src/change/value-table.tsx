/** Table of the current and new values of rows. */
import type { Profile } from "../api/config-types";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { DataTable } from "../kit/data-table";

export interface ValueRow {
  key: string;
  /** One column each; the last is the new value. */
  values: readonly string[];
  note?: string | false | undefined;
}

interface Props {
  /** Test IDs of rows and values. */
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

/** The values of a profile. */
export function ProfileValues({ one, head }: ProfileProps) {
  const rows = Object.entries(one.values).map(([key, value]) => ({
    key,
    values: [valueText(key, value, one.units[key] ?? "")],
  }));
  return <ValueTable heads={[head.parameter, head.value]} rows={rows} />;
}
