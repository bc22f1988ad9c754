/** Column heads of the list: a press sorts by the column, and the head shows it. */

import { besideAutopilot } from "../bench/role";
import type { AddressChoice } from "../bench/route";
import { cell, Tick } from "../kit/field";
import { lazy } from "../kit/lazy";
import { text } from "../text";
import { pressed, type SortColumn, type Sorting } from "./order";
import { isSelected, select } from "./selection";

const CommandHeads = lazy(() => import("../role/commanders").then(file => file.CommandHeads));

interface Props {
  shown: readonly string[];
  sorting: AddressChoice<Sorting | null>;
}

export function Head({ shown, sorting }: Props) {
  const head = text.servos.head;
  const ticked = shown.filter(isSelected).length;
  return (
    <div role="row" class="servo-grid servo-head">
      <span role="columnheader" class="c-tick">
        <Tick
          label={text.servos.selectAll}
          bare
          at={cell(ticked > 0 && ticked === shown.length, on => select(shown, on))}
          some={ticked > 0 && ticked < shown.length}
          testid="select-all"
        />
      </span>
      <Sorted column="angle" label={head.angle} place="c-angle right" sorting={sorting} />
      <Sorted column="name" label={head.servo} place="c-name" sorting={sorting} />
      <Sorted column="ids" label={head.ids} place="c-ids" sorting={sorting} />
      <Sorted column="health" label={head.health} place="c-health" sorting={sorting} />
      <span role="columnheader" class="c-spark">
        {head.recent}
      </span>
      <Sorted column="supply" label={head.supply} place="c-supply" sorting={sorting} />
      {besideAutopilot.value ? (
        <CommandHeads />
      ) : (
        <Sorted column="age" label={head.age} place="c-age" sorting={sorting} />
      )}
      <Sorted column="rom" label={head.rom} place="c-rom" sorting={sorting} />
    </div>
  );
}

interface SortedProps {
  column: SortColumn;
  label: string;
  place: string;
  sorting: AddressChoice<Sorting | null>;
}

function Sorted({ column, label, place, sorting }: SortedProps) {
  const way = sorting.value?.column === column ? sorting.value.way : "none";
  return (
    <span role="columnheader" class={place} aria-sort={way}>
      <button
        type="button"
        class="sorter"
        data-testid={`sort-${column}`}
        title={text.servos.sortBy(label)}
        onClick={() => {
          sorting.value = pressed(sorting.peek(), column);
        }}
      >
        {label}
        <svg width="8" height="10" viewBox="0 0 8 10" aria-hidden="true" data-way={way}>
          <path class="up" d="M4 0l3.5 4h-7z" />
          <path class="down" d="M4 10l3.5-4h-7z" />
        </svg>
      </button>
    </span>
  );
}
