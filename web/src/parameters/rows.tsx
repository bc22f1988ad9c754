/** The table of rows: those of a tab, of a search, or the changed ones. */

import { type Signal, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Row } from "../api/types";
import { type Catalog, catalog } from "../bench/catalog";
import { problemText } from "../bench/facts";
import { favourites } from "../bench/favourites";
import { servo } from "../bench/fleet";
import { up } from "../bench/link";
import { readOnly } from "../bench/model";
import type { Sheet } from "../bench/parameters";
import { observing } from "../bench/role";
import { type AddressChoice, changeChoices } from "../bench/route";
import { adviceOn } from "../bench/row-help";
import { ParameterRow } from "../change/row";
import { editing } from "../change/words";
import { Button } from "../kit/button";
import { Icon } from "../kit/icon";
import { text } from "../text";
import { ProductFacts } from "./product";

const strings = editing.fold;

interface Props {
  sheet: Sheet;
  tab: string;
  hash: string;
  wanted: AddressChoice<string>;
  changedOnly: boolean;
  favouritesOnly: boolean;
  onRetry: () => void;
}

export function ParameterRows({ sheet, tab, hash, wanted, changedOnly, favouritesOnly, onRetry }: Props) {
  const table = useRef<HTMLDivElement>(null);
  const unlocked = useSignal(false);
  const unfolded = useSignal(false);
  const known = catalog.value;
  const has = sheet.keys.value;

  useEffect(() => {
    const row = known && (known.rows.get(hash) ?? [...known.rows.values()].find(one => one.name === hash));
    if (!row || !has) return;
    const target = table.current?.querySelector<HTMLElement>(`#row-${row.key}`);
    target?.scrollIntoView({ block: "center" });
    target?.querySelector<HTMLElement>("input, button[role=switch]")?.focus();
  }, [hash, tab, has, known]);

  if (sheet.problem.value && !has) {
    return (
      <div class="scroll">
        <p class="notice-line">
          {text.params.notRead(problemText(sheet.problem.value))}{" "}
          <Button live onClick={() => void sheet.load(true)}>
            {text.params.readAgain}
          </Button>
        </p>
      </div>
    );
  }
  const fixed = observing.value || readOnly(servo(sheet.uid));
  if (observing.value && !has) return <p class="notice-line scroll">{text.motion.whileObserving}</p>;
  if (!known || !has) return <p class="notice-line scroll">{text.params.reading}</p>;

  const rows = (
    favouritesOnly && wanted.value === ""
      ? known.tabs.flatMap(one => one.rows).filter(row => favourites.value.has(row.key))
      : choose(known, sheet, tab, wanted.value, changedOnly)
  ).filter(row => has.includes(row.key));
  const goTo = (name: string) => {
    const row = [...known.rows.values()].find(one => one.name === name);
    changeChoices({ q: "", filter: "", tab: "" }, row?.key);
  };
  const experts = rows.filter(row => row.expert);
  // Shown if searched for or changed; folded otherwise.
  const sought =
    wanted.value !== "" ||
    changedOnly ||
    favouritesOnly ||
    experts.some(row => row.key === hash || row.name === hash);
  const folded = !unfolded.value && !sought;
  const asFacts = tab === "product" && wanted.value === "" && !changedOnly && !favouritesOnly;
  return (
    <div class="scroll" ref={table}>
      {asFacts && <ProductFacts sheet={sheet} />}
      <div role="table" class="params" hidden={asFacts} aria-label={text.params.title}>
        <Head />
        {(asFacts ? [] : rows).map(row => (
          <>
            {row === experts[0] && (
              <Experts
                rows={experts}
                folded={folded}
                fixed={sought}
                unfolded={unfolded}
                unlocked={unlocked}
              />
            )}
            {!(row.expert && folded) && (
              <ParameterRow
                key={row.key}
                sheet={sheet}
                row={fixed ? { ...row, access: "r" } : row}
                onGoTo={goTo}
                onRetry={onRetry}
                locked={row.expert && !unlocked.value}
              />
            )}
          </>
        ))}
      </div>
      {rows.length === 0 && (
        <p class="notice-line">
          {wanted.value !== ""
            ? text.params.noneFound(wanted.value)
            : favouritesOnly
              ? text.params.noFavourites
              : text.params.noneChanged}
        </p>
      )}
      <p class="below">
        <button type="button" class="link small" disabled={!up.value} onClick={() => void sheet.load(true)}>
          {text.params.refresh}
        </button>
      </p>
    </div>
  );
}

function choose(known: Catalog, sheet: Sheet, tab: string, wanted: string, changedOnly: boolean): Row[] {
  const all = known.tabs.flatMap(one => one.rows);
  const words = wanted.trim().toLowerCase();
  if (words !== "") {
    return all.filter(row => [row.label, row.name, row.key].some(fact => fact.toLowerCase().includes(words)));
  }
  if (changedOnly) {
    const unsaved = servo(sheet.uid)?.unsaved ?? [];
    return all.filter(row => sheet.drafts.get(row.key) !== undefined || unsaved.includes(row.key));
  }
  return [...(known.tabs.find(one => one.key === tab)?.rows ?? [])];
}

function Head() {
  const head = text.params.head;
  return (
    <div role="row" class="prow params-head">
      <span class="p-mark" role="presentation" />
      <span role="columnheader" class="p-name">
        {head.parameter}
      </span>
      <span role="columnheader" class="p-box">
        {head.value}
      </span>
      <span role="columnheader" class="p-range">
        {head.range}
      </span>
      <span role="columnheader" class="p-held">
        {head.ram}
      </span>
      <span role="columnheader" class="p-held">
        {head.rom}
      </span>
      <span role="columnheader" class="p-held">
        {head.default}
      </span>
    </div>
  );
}

interface ExpertsProps {
  rows: readonly Row[];
  folded: boolean;
  /** A searched row is shown unfolded. */
  fixed: boolean;
  unfolded: Signal<boolean>;
  unlocked: Signal<boolean>;
}

/**
 * Head of the rows that the maker advises not to change: their names while folded; the reason and the lock while
 * unfolded.
 */
function Experts({ rows, folded, fixed, unfolded, unlocked }: ExpertsProps) {
  return (
    <div role="row" class="locked small second" data-testid="experts">
      <Icon name="lock" size={16} />
      <span role="cell">
        {strings.what(rows.map(row => row.label).join(", "))} {rows[0] && adviceOn(rows[0])}
      </span>
      <span role="cell" class="plain-cell">
        {!fixed && (
          <button
            type="button"
            class="button"
            aria-expanded={!folded}
            data-testid="unfold-expert"
            onClick={() => {
              unfolded.value = folded;
            }}
          >
            {folded ? strings.show(rows.length) : strings.hide}
          </button>
        )}
        {!folded && !unlocked.value && (
          <Button
            testid="unlock-expert"
            onClick={() => {
              unlocked.value = true;
            }}
          >
            {text.params.unlock}
          </Button>
        )}
      </span>
    </div>
  );
}
