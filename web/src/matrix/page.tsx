/** The matrix page: parameters of many servos, staged by cell, applied together. */

import { useComputed, useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { problemOf } from "../api/client";
import type { Row } from "../api/types";
import { type Catalog, catalog } from "../bench/catalog";
import { problemText } from "../bench/facts";
import { all, servo } from "../bench/fleet";
import { connection, up } from "../bench/link";
import { loadSheets, sheetOf } from "../bench/parameters";
import { go, inAddress, oneInAddress, pathOf, wordInAddress } from "../bench/route";
import { beginChange, type ChangeRequest } from "../change/flow";
import { batchChange, batchSaveChange } from "../change/requests";
import { Button } from "../kit/button";
import { Unread } from "../kit/loaded";
import { Search } from "../kit/search";
import { Segments } from "../kit/segments";
import { MatrixBar } from "./bar";
import { CopyDialog } from "./copy";
import { type Group, MatrixGrid } from "./grid";
import { SetDialog } from "./set";
import { rowOutliers, uidsIn } from "./state";
import { matrix as strings } from "./words";
import "./matrix.css";

const FILTERS = ["all", "differ", "changed"] as const;
type Filter = (typeof FILTERS)[number];

const listed = inAddress("uids", uidsIn, uids => uids.join(","));
const wanted = wordInAddress("q");
const filter = oneInAddress("filter", FILTERS);
type Open = { what: "set"; row: Row } | { what: "copy"; uid: string } | { what: "apply" | "save" };

export function MatrixPage({ hash }: { hash: string }) {
  // Only the list is passed down: cells redraw themselves.
  // In the order of the address, if it has servos; else in the order of the list.
  const shownIn = useComputed(() => {
    if (listed.value.length > 0) return listed.value.filter(uid => servo(uid) !== undefined).join(" ");
    return all.value
      .filter(one => one.online)
      .map(one => one.uid)
      .join(" ");
  });
  const shown = shownIn.value;
  const uids = useMemo(() => split(shown), [shown]);
  const open = useSignal<Open | null>(null);
  const problem = useSignal<string | null>(null);
  const refused = useSignal<string | null>(null);
  const reading = useSignal(false);
  const round = connection.value;

  const load = async (refresh = false) => {
    reading.value = true;
    problem.value = null;
    try {
      await loadSheets(uids, refresh);
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
    reading.value = false;
  };
  useEffect(() => {
    if (round > 0) void load();
  }, [round, shown]);
  const begin = async (request: ChangeRequest) => {
    refused.value = null;
    refused.value = await beginChange(request);
  };
  const known = catalog.value;
  const [differ = "0", changed = "0"] = split(
    useComputed(() => countRows(catalog.value, split(shownIn.value)).join(" ")).value,
  );
  if (uids.length === 0) return <NoServos />;
  const groups = known ? grouped(known, uids, wanted.value, filter.value) : [];
  const close = () => {
    open.value = null;
  };
  const present = open.value;
  return (
    <div class="page">
      <div class="page-head">
        <h1>{strings.title}</h1>
        <span class="dim">{strings.servos(uids.length)}</span>
        <Search label={strings.search} at={wanted} />
        <Segments<Filter>
          label={strings.filter}
          chosen={filter.value}
          onChoose={key => {
            filter.value = key;
          }}
          options={[
            { key: "all", label: strings.all },
            { key: "differ", label: strings.differ(Number(differ)) },
            { key: "changed", label: strings.changed(Number(changed)) },
          ]}
        />
        <Button onClick={() => go(pathOf("servos", null))}>{strings.choose}</Button>
      </div>
      <Unread why={problem.value} sentence={strings.failed} onAgain={() => void load(true)} />
      {known === null ? (
        <p class="notice-line">{strings.reading}</p>
      ) : (
        <MatrixGrid
          uids={uids}
          groups={groups}
          hash={hash}
          onSet={row => {
            open.value = { what: "set", row };
          }}
          onCopy={uid => {
            open.value = { what: "copy", uid };
          }}
        >
          {groups.length === 0 && (
            <p class="notice-line">{wanted.value === "" ? strings.none : strings.noneFound(wanted.value)}</p>
          )}
          <p class="below small dim">
            <button
              type="button"
              class="link small"
              disabled={!up.value || reading.value}
              onClick={() => void load(true)}
            >
              {strings.refresh}
            </button>{" "}
            <span class="touch-hide">{strings.keys}</span>
          </p>
        </MatrixGrid>
      )}
      <MatrixBar
        uids={uids}
        problem={refused.value}
        onReview={() => void begin(batchChange(uids))}
        onSave={() => void begin(batchSaveChange(uids.filter(uid => (servo(uid)?.unsaved.length ?? 0) > 0)))}
      />
      {present?.what === "set" && <SetDialog uids={uids} row={present.row} onClose={close} />}
      {present?.what === "copy" && known && (
        <CopyDialog from={present.uid} uids={uids} rows={settable(known)} onClose={close} />
      )}
    </div>
  );
}

function NoServos() {
  return (
    <div class="page">
      <section class="empty">
        <div>
          <h1>{strings.empty}</h1>
          <p class="second">{strings.emptyLine}</p>
          <p class="below-line">
            <Button look="primary" onClick={() => go(pathOf("servos", null))}>
              {strings.toServos}
            </Button>
          </p>
        </div>
      </section>
    </div>
  );
}

function settable(known: Catalog): Row[] {
  return known.tabs.flatMap(tab => tab.rows.filter(row => row.access === "rw"));
}

function isChanged(row: Row, uids: readonly string[]): boolean {
  return uids.some(
    uid => sheetOf(uid).drafts.get(row.key) !== undefined || servo(uid)?.unsaved.includes(row.key) === true,
  );
}

function split(joined: string): string[] {
  return joined === "" ? [] : joined.split(" ");
}

/** Number of rows that differ within a model, and of rows changed on any servo. */
function countRows(known: Catalog | null, uids: readonly string[]): [number, number] {
  const rows = known ? settable(known) : [];
  return [
    rows.filter(row => rowOutliers(row, uids).size > 0).length,
    rows.filter(row => isChanged(row, uids)).length,
  ];
}

function grouped(known: Catalog, uids: readonly string[], wanted: string, filter: Filter): Group[] {
  const words = wanted.trim().toLowerCase();
  const passes = (row: Row) => {
    if (row.access !== "rw") return false;
    if (words !== "") {
      return [row.label, row.name, row.key].some(fact => fact.toLowerCase().includes(words));
    }
    if (filter === "differ") return rowOutliers(row, uids).size > 0;
    return filter === "all" || isChanged(row, uids);
  };
  return known.tabs
    .map(tab => ({
      key: tab.key,
      label: tab.label,
      rows: tab.rows
        .filter(passes)
        .filter(row => uids.some(uid => sheetOf(uid).keys.value?.includes(row.key) ?? false)),
    }))
    .filter(group => group.rows.length > 0);
}
