/** The grid of the matrix: sticky heads, groups, and keyboard navigation. */
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import type { Row } from "../api/types";
import { nameOf, servo } from "../bench/fleet";
import { modelName } from "../bench/model";
import { sheetOf } from "../bench/parameters";
import { observing } from "../bench/role";
import { pathOf } from "../bench/route";
import { aboutRow } from "../bench/row-help";
import { conditionHere } from "../bench/servo-condition";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { text } from "../text";
import { MatrixCell } from "./cell";
import { isOwn, rowOutliers } from "./state";
import { matrix as strings } from "./words";

export interface Group {
  key: string;
  label: string;
  rows: readonly Row[];
}

interface Props {
  uids: readonly string[];
  groups: readonly Group[];
  hash: string;
  onSet: (row: Row) => void;
  onCopy: (uid: string) => void;
  children: ComponentChildren;
}

const STEPS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowUp: [-1, 0],
  ArrowDown: [1, 0],
  ArrowLeft: [0, -1],
  ArrowRight: [0, 1],
  PageUp: [-8, 0],
  PageDown: [8, 0],
};

/** Stops of the arrow keys: a cell, or the button of a head. */
const STOPS = "[data-stop]";

export function MatrixGrid({ uids, groups, hash, onSet, onCopy, children }: Props) {
  const table = useRef<HTMLTableElement>(null);
  const stops = () =>
    [...(table.current?.rows ?? [])]
      .map(row => [...row.querySelectorAll<HTMLElement>(STOPS)])
      .filter(row => row.length > 0);

  // Roving tabindex: one element of the grid is in the tab order, the last focused one or the first cell.
  useEffect(() => {
    const all = stops().flat();
    if (!all.some(one => one.tabIndex === 0)) {
      const first = table.current?.querySelector<HTMLElement>(`tbody td${STOPS}`) ?? all[0];
      if (first) first.tabIndex = 0;
    }
  });
  // Once per link, and not if the focus has moved on.
  const led = useRef("");
  useEffect(() => {
    const row = table.current?.querySelector<HTMLElement>(`[data-key="${CSS.escape(hash)}"]`);
    if (!row || led.current === hash) return;
    led.current = hash;
    row.scrollIntoView({ block: "center" });
    row.querySelector<HTMLElement>(`td${STOPS}`)?.focus();
  });

  const onFocus = (event: FocusEvent) => {
    const here = (event.target as HTMLElement).closest<HTMLElement>(STOPS);
    if (!here) return;
    for (const one of stops().flat()) one.tabIndex = one === here ? 0 : -1;
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const here = event.target as HTMLElement;
    if (!here.matches(STOPS) || event.altKey || event.metaKey) return;
    const lines = stops();
    const y = lines.findIndex(line => line.includes(here));
    const line = lines[y] ?? [];
    const x = line.indexOf(here);
    // The heads of servos start one column to the right of the heads of rows.
    const shift = y === 0 ? 1 : 0;
    let to: HTMLElement | undefined;
    const step = STEPS[event.key];
    if (event.key === "Home") to = event.ctrlKey ? lines[1]?.[1] : line[0];
    else if (event.key === "End") to = event.ctrlKey ? lines.at(-1)?.at(-1) : line.at(-1);
    else if (step) {
      const row = Math.min(lines.length - 1, Math.max(0, y + step[0]));
      to = lines[row]?.[Math.max(0, x + shift - (row === 0 ? 1 : 0) + step[1])];
    }
    if (!to) return;
    event.preventDefault();
    to.focus();
  };

  return (
    <div class="scroll matrix-scroll">
      <table
        ref={table}
        // biome-ignore lint/a11y/noNoninteractiveElementToInteractiveRole: a grid is a table whose cells are edited
        role="grid"
        class="matrix"
        aria-label={strings.label}
        data-testid="matrix"
        onFocusIn={onFocus}
        onKeyDown={onKeyDown}
      >
        <thead>
          <tr>
            <th scope="col" class="m-corner">
              {text.params.head.parameter}
            </th>
            {uids.map(uid => (
              <ColumnHead key={uid} uid={uid} alone={uids.length < 2} onCopy={onCopy} />
            ))}
          </tr>
        </thead>
        {groups.map(group => (
          <tbody key={group.key}>
            <tr class="m-group">
              <th scope="rowgroup" colSpan={uids.length + 1}>
                <span>{strings.group(group.label, group.rows.length)}</span>
              </th>
            </tr>
            {group.rows.map(row => (
              <Line key={row.key} row={row} uids={uids} onSet={onSet} />
            ))}
          </tbody>
        ))}
      </table>
      {children}
    </div>
  );
}

function ColumnHead({ uid, alone, onCopy }: { uid: string; alone: boolean; onCopy: (uid: string) => void }) {
  const one = servo(uid);
  if (!one) return <th scope="col" />;
  const name = nameOf(one);
  const condition = conditionHere(one);
  const path = pathOf("overview", uid);
  return (
    <th scope="col" class={one.online ? "" : "away"} data-testid={`column-${uid}`}>
      <a href={path} title={text.servos.open(name)} onClick={event => follow(event, path)}>
        {name}
      </a>
      <small title={condition.line}>
        <Glyph kind={condition.kind} size={13} /> {condition.headline}
      </small>
      <small>{modelName(one)}</small>
      {one.unsaved.length > 0 && (
        <small class="half k-intent">
          <Icon name="half" size={13} /> {text.servos.ramOnly(one.unsaved.length)}
        </small>
      )}
      {!alone && !observing.value && (
        <button
          type="button"
          class="link small"
          data-stop
          tabIndex={-1}
          aria-label={strings.copy(name)}
          data-testid={`copy-${uid}`}
          onClick={() => onCopy(uid)}
        >
          {strings.copyWord}
        </button>
      )}
    </th>
  );
}

function Line({ row, uids, onSet }: { row: Row; uids: readonly string[]; onSet: (row: Row) => void }) {
  const odd = rowOutliers(row, uids);
  const able =
    !observing.value &&
    !row.expert &&
    !isOwn(row) &&
    uids.some(uid => sheetOf(uid).keys.value?.includes(row.key));
  return (
    <tr data-key={row.key} data-testid={`line-${row.key}`} data-odd={odd.size > 0}>
      <th scope="row" title={aboutRow(row)}>
        <span class="m-name">
          <span>
            {row.label}
            <small class="dim">
              {row.name}, §{row.section}
            </small>
          </span>
          {row.expert ? (
            <span class="dim m-lock" title={strings.locked}>
              <Icon name="lock" size={14} />
              <span class="hidden-text">{strings.locked}</span>
            </span>
          ) : (
            <button
              type="button"
              class="link small"
              data-stop
              tabIndex={-1}
              disabled={!able}
              aria-label={strings.setAll(row.label)}
              data-testid={`set-${row.key}`}
              onClick={() => onSet(row)}
            >
              {able ? strings.setAllWord : ""}
            </button>
          )}
        </span>
      </th>
      {uids.map(uid => (
        <MatrixCell key={uid} uid={uid} row={row} odd={odd.get(uid)} />
      ))}
    </tr>
  );
}
