/** The Servos page: a row per servo, nodes waiting for a node ID, and help when there are no servos. */
import { untracked, useComputed, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { watchAllocations } from "../bench/allocations";
import { connected, stopped } from "../bench/bench";
import { now } from "../bench/clock";
import { needsAttention } from "../bench/condition";
import { all, angleOf, isFound, type KnownServo, loaded, nameOf, peekServo, servo } from "../bench/fleet";
import { figureNow } from "../bench/fresh";
import { up } from "../bench/link";
import { motionOn } from "../bench/moving";
import { besideAutopilot, commanderOf, elsewhere } from "../bench/role";
import { type AddressChoice, changeChoices, inAddress, oneInAddress, wordInAddress } from "../bench/route";
import { phone } from "../bench/screen";
import { conditionHere } from "../bench/servo-condition";
import { restorable } from "../change/restorable";
import type { RestoreProps } from "../change/restore-button";
import { Button } from "../kit/button";
import { Choice, cell } from "../kit/field";
import { lazy } from "../kit/lazy";
import { Note } from "../kit/note";
import { Search } from "../kit/search";
import { Segments } from "../kit/segments";
import { text } from "../text";
import { Head } from "./columns";
import { density } from "./density";
import { GROUPINGS, type Grouping, groupBy, grouping } from "./grouping";
import {
  ordered,
  type SortColumn,
  type Sorting,
  severity,
  sortingIn,
  sortingText,
  standsStill,
} from "./order";
import { ServoRow } from "./row";
import { selected } from "./selection";
import "./selection.css";
import { RowKeys } from "./row-keys";

const GroupedRows = lazy<{ uids: readonly string[]; by: Grouping }>(() =>
  import("./headings").then(file => file.GroupedRows),
);
const ManyPlot = lazy<{ uids: readonly string[] }>(() => import("./many-plot").then(file => file.ManyPlot));
const EmptyServos = lazy<{ loading: boolean }>(() => import("../servo/empty").then(file => file.EmptyServos));
const Reconnect = lazy<object>(() => import("../servo/empty").then(file => file.Reconnect));
const RestoreButton = lazy<RestoreProps>(() =>
  import("../change/restore-button").then(file => file.RestoreButton),
);
const SelectionBar = lazy<{ plotting: boolean; onPlot: () => void }>(() =>
  import("./selection-bar").then(file => file.SelectionBar),
);
const SortChoice = lazy<{ sorting: AddressChoice<Sorting | null> }>(() =>
  import("./sort-choice").then(file => file.SortChoice),
);
const Waiting = lazy<object>(() => import("../servo/waiting-nodes").then(file => file.Waiting));
const WallOfHorns = lazy<{ uids: readonly string[] }>(() =>
  import("../view3d/wall").then(file => file.WallOfHorns),
);

const FILTERS = ["all", "attention", "unsaved", "elsewhere"] as const;
type Filter = (typeof FILTERS)[number];

const wanted = wordInAddress("q");
const filter = oneInAddress("filter", FILTERS);
const model = wordInAddress("model");
const sorting = inAddress("sort", sortingIn, sortingText);
const view = oneInAddress("view", ["list", "wall"]);

export function ServosPage() {
  useEffect(() => watchAllocations().end, []);
  const plotting = useSignal(false);
  const counts = useComputed(() => ({
    known: all.value.length,
    online: all.value.filter(one => one.online).length,
    attention: all.value.filter(one => needsAttention(conditionHere(one).kind)).length,
    unsaved: all.value.filter(one => one.unsaved.length > 0).length,
    elsewhere: elsewhere.value.length,
  })).value;
  // Only the list of UIDs is passed down: each row redraws itself.
  const found = useComputed(() =>
    all.value
      .filter(one => isFound(one, wanted.value) && passes(one, filter.value))
      .filter(one => model.value === "" || one.model === model.value)
      .map(one => one.uid)
      .join(" "),
  );
  const shown = useComputed(() => sorted(words(found.value), sorting.value).join(" ")).value;
  const uids = words(shown);
  const by = grouping.value;
  const models = words(
    useComputed(() => [...new Set(all.value.flatMap(one => one.model ?? []))].sort().join(" ")).value,
  );
  const chosen = selected.value;
  const showAll = () => changeChoices({ q: "", filter: "", model: "" });
  return (
    <div class="page servos-page" data-density={density.value}>
      <div class="page-head">
        <h1>{text.servos.title}</h1>
        {counts.known > 0 && (
          <span class="dim known">{text.servos.known(counts.known, up.value ? counts.online : null)}</span>
        )}
        {counts.known > 0 && (
          <>
            <Search label={text.servos.search} at={wanted} />
            <FilterChoice
              all={counts.known}
              attention={counts.attention}
              unsaved={counts.unsaved}
              elsewhere={counts.elsewhere}
            />
            {models.length > 1 && (
              <Choice
                label={text.servos.model}
                bare
                testid="filter-model"
                at={model}
                options={[
                  { key: "", label: text.servos.everyModel },
                  ...models.map(one => ({ key: one, label: one })),
                ]}
              />
            )}
            {view.value === "list" && (
              <>
                <Choice
                  label={text.servos.group.label}
                  bare
                  testid="group-by"
                  at={cell<string>(by, key => groupBy(key))}
                  options={GROUPINGS.map(key => ({ key, label: text.servos.group[key] }))}
                />
                <SortChoice sorting={sorting} />
              </>
            )}
            <Segments<"list" | "compact" | "wall">
              label={text.servos.view}
              chosen={view.value === "wall" ? "wall" : density.value}
              onChoose={key => {
                view.value = key === "wall" ? "wall" : "list";
                if (key !== "wall") density.value = key;
              }}
              options={[
                { key: "list", label: text.servos.list },
                { key: "compact", label: text.servos.compact },
                { key: "wall", label: text.servos.wall },
              ]}
            />
          </>
        )}
      </div>
      <div class="scroll">
        {counts.known > 0 && !connected.value && <Reconnect />}
        <OutputsOff />
        {counts.known > 0 && view.value === "wall" && uids.length > 0 && <WallOfHorns uids={uids} />}
        {counts.known > 0 && view.value === "list" && (
          <div role="table" aria-label={text.servos.title} class="servos" data-beside={besideAutopilot.value}>
            <Head shown={uids} sorting={sorting} />
            {by === "none" ? (
              uids.map(uid => <ServoRow key={uid} uid={uid} />)
            ) : (
              <GroupedRows uids={uids} by={by} />
            )}
          </div>
        )}
        {counts.known > 0 && uids.length === 0 && (
          <p class="notice-line">
            {text.servos.nothingFound} <Button onClick={showAll}>{text.servos.showAll}</Button>
          </p>
        )}
        {view.value === "list" && <RowKeys />}
        <Waiting />
        {counts.known === 0 && <EmptyServos loading={!loaded.value} />}
        {counts.known > 0 && view.value === "list" && <p class="small dim below">{text.servos.more}</p>}
      </div>
      {plotting.value && chosen.length > 0 && (
        <div class="selection-plot">
          <ManyPlot uids={chosen} />
        </div>
      )}
      <SelectionBar
        plotting={plotting.value}
        onPlot={() => {
          plotting.value = !plotting.value;
        }}
      />
    </div>
  );
}

/** The choice of servos: segments, or a list where space is short. */
function FilterChoice(counts: Record<Filter, number>) {
  // Beside an autopilot the list shows who commands a servo in place of its state in ROM.
  const hidden = besideAutopilot.value ? "unsaved" : "elsewhere";
  const options = FILTERS.filter(key => key !== hidden || key === filter.value).map(key => ({
    key,
    label: text.servos[key](counts[key]),
  }));
  if (phone.value)
    return (
      <Choice
        label={text.servos.filter}
        bare
        testid="filter"
        at={cell<string>(filter.value, key => {
          filter.value = key as Filter;
        })}
        options={options}
      />
    );
  return (
    <Segments<Filter>
      label={text.servos.filter}
      chosen={filter.value}
      onChoose={key => {
        filter.value = key;
      }}
      options={options}
    />
  );
}

/**
 * Servos whose output was switched off by a session, and the button to restore it. While a stop is latched, its band
 * shows this.
 */
function OutputsOff() {
  const n = restorable.value.length;
  const refused = useSignal<string | null>(null);
  if (n === 0 || stopped.value || motionOn()) return null;
  return (
    <div class="notice-line outputs-off" data-testid="outputs-off">
      <span>{text.output.offOn(n)}</span>
      <RestoreButton
        uids={null}
        testid="restore-all"
        onRefused={why => {
          refused.value = why;
        }}
      />
      <Note testid="restore-refused">{refused.value}</Note>
    </div>
  );
}

function words(joined: string): string[] {
  return joined === "" ? [] : joined.split(" ");
}

/** Sorted once by a live figure, so that rows stay in place; otherwise sorted again with every change. */
function sorted(uids: readonly string[], by: Sorting | null): readonly string[] {
  if (by === null) return uids;
  if (!standsStill(by.column)) return ordered(uids, by.way, uid => factOf(servo(uid), by.column));
  return untracked(() => ordered(uids, by.way, uid => factOf(peekServo(uid), by.column)));
}

function factOf(one: KnownServo | undefined, column: SortColumn): number | string | null {
  if (!one) return null;
  switch (column) {
    case "angle":
      return angleOf(one, now.value).value;
    case "name":
      return nameOf(one);
    case "ids":
      return one.servo_id;
    case "health":
      return severity(conditionHere(one).kind);
    case "supply":
      return figureNow(one.uid, "current_voltage").value;
    case "age":
      return angleOf(one, now.value).age;
    case "rom":
      return -((one.drift ?? []).length > 0 ? 1000 : one.unsaved.length);
  }
}

function passes(one: KnownServo, filter: Filter): boolean {
  if (filter === "attention") return needsAttention(conditionHere(one).kind);
  if (filter === "elsewhere") return commanderOf(one) !== undefined;
  return filter === "all" || one.unsaved.length > 0;
}
