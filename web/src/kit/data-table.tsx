/** The table of a list: columns and rows as data, sorted by its heads, folded to labelled lines where it is narrow. */

import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { Cell } from "./field";
import { follow } from "./follow";
import "./table.css";

export interface Column<R> {
  key: string;
  head: string;
  cell: (row: R) => ComponentChildren;
  /** Figures, and what stands in line with them. */
  right?: boolean;
  /** The head for screen readers alone: boxes to tick, buttons. */
  bare?: boolean;
  /** In place of the head's word. */
  headCell?: ComponentChildren;
  /** What a press on the head sorts by. */
  by?: (row: R) => string | number;
}

interface Props<R> {
  label: string;
  columns: readonly Column<R>[];
  rows: readonly R[];
  id: (row: R) => string | number;
  testid?: (row: R) => string;
  /** It is shown as what was, not what is. */
  away?: (row: R) => boolean;
  kind?: (row: R) => string;
  /** All of it is old. */
  old?: boolean;
  /** The column sorted by, "-" before it for the other way round; kept in the address by some. */
  order?: Cell<string>;
}

export function DataTable<R>(props: Props<R>) {
  const { label, columns, rows, id, testid, away, kind, old = false } = props;
  const own = useSignal("");
  const order = props.order ?? own;
  const down = order.value.startsWith("-");
  const sorted = columns.find(one => one.by && one.key === order.value.replace("-", ""));
  const by = sorted?.by;
  const shown = by ? [...rows].sort((a, b) => compare(by(a), by(b)) * (down ? -1 : 1)) : rows;
  return (
    <div class="table-fit">
      <table class={old ? "table old" : "table"} aria-label={label}>
        <thead>
          <tr>
            {columns.map(one => {
              const way = one === sorted ? (down ? "descending" : "ascending") : undefined;
              const word =
                one.headCell ?? (one.bare ? <span class="hidden-text">{one.head}</span> : one.head);
              // A column of buttons has no name.
              if (one.head === "" && !one.headCell) return <td key={one.key} />;
              return (
                <th key={one.key} scope="col" class={one.right ? "right" : ""} aria-sort={way}>
                  {one.by ? (
                    <button
                      type="button"
                      class="table-sort"
                      onClick={() => {
                        order.value = way === "ascending" ? `-${one.key}` : way ? "" : one.key;
                      }}
                    >
                      {word}
                      <span aria-hidden="true">{way ? (down ? "▾" : "▴") : ""}</span>
                    </button>
                  ) : (
                    word
                  )}
                </th>
              );
            })}
          </tr>
        </thead>
        <tbody>
          {shown.map(row => (
            <tr
              key={id(row)}
              {...(testid ? { "data-testid": testid(row) } : {})}
              {...(away ? { "data-away": away(row) } : {})}
              {...(kind ? { "data-kind": kind(row) } : {})}
            >
              {columns.map(one => (
                <td
                  key={one.key}
                  class={one.right ? "right" : ""}
                  data-label={one.bare ? "" : one.head}
                  data-column={one.key}
                >
                  <div>{one.cell(row)}</div>
                </td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function compare(a: string | number, b: string | number): number {
  return typeof a === "number" && typeof b === "number"
    ? a - b
    : String(a).localeCompare(String(b), undefined, { numeric: true });
}

/** The link of a row: all of the row is its target. */
export function RowLink({
  path,
  title,
  children,
}: {
  path: string;
  title?: string;
  children: ComponentChildren;
}) {
  return (
    <a
      class="row-link strong"
      href={path}
      onClick={event => follow(event, path)}
      {...(title ? { title } : {})}
    >
      {children}
    </a>
  );
}
