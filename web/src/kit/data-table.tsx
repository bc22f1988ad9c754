/** The table of a list: columns and rows as data, sorted by its heads, folded to labelled lines where narrow. */

import { useSignal } from "@preact/signals";
import { type ComponentChildren, Fragment } from "preact";
import type { Cell } from "./field";
import { follow } from "./follow";
import "./table.css";

export interface Column<R> {
  key: string;
  head: string;
  cell: (row: R) => ComponentChildren;
  /** Right-aligned: figures and their heads. */
  right?: boolean;
  /** Head for screen readers only: check boxes, buttons. */
  bare?: boolean;
  /** Replaces the word of the head. */
  headCell?: ComponentChildren;
  /** Key that a press on the head sorts by. */
  by?: (row: R) => string | number;
  /** Row header. */
  name?: boolean;
  /** Additional classes of a cell. */
  look?: (row: R) => string;
}

interface Props<R> {
  label: string;
  columns: readonly Column<R>[];
  /** Null while unknown: no table. */
  rows: readonly R[] | null | undefined;
  id: (row: R) => string | number;
  /** Shown instead of a table without rows. */
  empty?: ComponentChildren;
  /** `data-` attributes of a row. A row that is `away` is shown as past. */
  data?: (row: R) => Readonly<Record<string, string | boolean | undefined>>;
  testid?: string;
  /** All values are stale. */
  old?: boolean;
  /** For a few figures in a dialog or panel: no edges, does not fold. */
  small?: boolean;
  /** Title of a section that starts with this row. */
  part?: (row: R) => ComponentChildren;
  /** The sort column, with "-" before it for descending; some pages store it in the address. */
  order?: Cell<string>;
}

export function DataTable<R>(props: Props<R>) {
  const { label, columns, rows, id, data, part, old = false, small = false } = props;
  const own = useSignal("");
  const order = props.order ?? own;
  const down = order.value.startsWith("-");
  const sorted = columns.find(one => one.by && one.key === order.value.replace("-", ""));
  const by = sorted?.by;
  if (!rows) return null;
  if (rows.length === 0 && props.empty !== undefined) return <>{props.empty}</>;
  const shown = by ? [...rows].sort((a, b) => compare(by(a), by(b)) * (down ? -1 : 1)) : rows;
  return (
    <div class={small ? "" : "table-fit"}>
      <table
        class={`table ${old ? "old" : ""} ${small ? "small-table" : ""}`}
        aria-label={label}
        data-testid={props.testid}
      >
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
          {shown.map(row => {
            const title = part?.(row);
            return (
              <Fragment key={id(row)}>
                {title && (
                  <tr class="table-part">
                    <th scope="rowgroup" colSpan={columns.length}>
                      {title}
                    </th>
                  </tr>
                )}
                <tr {...dataOf(data?.(row))}>
                  {columns.map(one => {
                    const Kind = one.name ? "th" : "td";
                    return (
                      <Kind
                        key={one.key}
                        class={one.right ? "right" : ""}
                        {...(one.name ? { scope: "row" } : {})}
                        data-label={one.bare ? "" : one.head}
                        data-column={one.key}
                      >
                        <div class={one.look?.(row)}>{one.cell(row)}</div>
                      </Kind>
                    );
                  })}
                </tr>
              </Fragment>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

function dataOf(data: ReturnType<NonNullable<Props<unknown>["data"]>> = {}) {
  return Object.fromEntries(Object.entries(data).map(([name, value]) => [`data-${name}`, value]));
}

function compare(a: string | number, b: string | number): number {
  return typeof a === "number" && typeof b === "number"
    ? a - b
    : String(a).localeCompare(String(b), undefined, { numeric: true });
}

/** The link of a row: the whole row is its target. */
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
