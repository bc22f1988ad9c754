/** The order of the list in a narrow window without column heads: a column and a direction. */
import type { AddressChoice } from "../bench/route";
import { Button } from "../kit/button";
import { Choice, cell } from "../kit/field";
import { text } from "../text";
import { COLUMNS, type SortColumn, type Sorting } from "./order";

export function SortChoice({ sorting }: { sorting: AddressChoice<Sorting | null> }) {
  const { head, sort } = text.servos;
  const label: Record<SortColumn, string> = {
    angle: head.angle,
    name: head.servo,
    ids: head.ids,
    health: head.health,
    supply: head.supply,
    age: head.age,
    rom: head.rom,
  };
  const present = sorting.value;
  return (
    <span class="sort-choice">
      <Choice
        label={sort.label}
        bare
        testid="sort-column"
        at={cell<string>(present?.column ?? "", key => {
          const column = COLUMNS.find(one => one === key);
          sorting.value = column ? { column, way: sorting.peek()?.way ?? "ascending" } : null;
        })}
        options={[
          { key: "", label: sort.none },
          ...COLUMNS.map(key => ({ key, label: text.servos.sortBy(label[key]) })),
        ]}
      />
      {present && (
        <Button
          testid="sort-way"
          onClick={() => {
            const way = present.way === "ascending" ? "descending" : "ascending";
            sorting.value = { ...present, way };
          }}
        >
          {sort[present.way]}
        </Button>
      )}
    </span>
  );
}
