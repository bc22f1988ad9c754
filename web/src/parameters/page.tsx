/** The Parameters page of one servo: head, tabs, rows, live panel, save bar and its dialogs. */
import { useSignal } from "@preact/signals";
import { useLayoutEffect } from "preact/hooks";
import { catalog } from "../bench/catalog";
import { staged, wrong } from "../bench/draft";
import { nameOf, servo } from "../bench/fleet";
import { onKey } from "../bench/keys";
import type { Sheet } from "../bench/parameters";
import { changeChoices, oneInAddress, wordInAddress } from "../bench/route";
import { narrow } from "../bench/screen";
import { apply, saveChange } from "../change/apply";
import { DiffDialog, willBe } from "../change/diff";
import { beginChange, underWay } from "../change/flow";
import { SaveBar } from "../change/save-bar";
import { UndoLine } from "../change/undo";
import { saving } from "../change/words";
import { Search } from "../kit/search";
import { Segments } from "../kit/segments";
import { SidePanel } from "../servo/side-panel";
import { useSheet } from "../servo/use-sheet";
import { text } from "../text";
import { LIVE_TAB, openTab, Tabs } from "./group-tabs";
import { LostLine } from "./lost-values";
import { predict, sideEffect } from "./prediction";
import { ParameterRows } from "./rows";
import { TorqueOff } from "./torque-off";

const FILTERS = ["all", "changed", "favourites"] as const;
type Filter = (typeof FILTERS)[number];

const wanted = wordInAddress("q");
const filter = oneInAddress("filter", FILTERS);
const chosenTab = wordInAddress("tab");

export function ParametersPage({ uid, hash }: { uid: string; hash: string }) {
  const sheet = useSheet(uid);
  const one = servo(uid);
  const diff = useSignal(false);
  const checking = useSignal(false);
  useLayoutEffect(() => {
    // Results of the last visit are outdated.
    if (sheet.busy.peek() === null) sheet.outcomes.value = new Map();
    sheet.written.value = null;
    sheet.trouble.value = null;
    return onKey("Ctrl+Z", () => sheet.drafts.undo());
  }, [uid]);

  const known = catalog.value;
  if (!one) return null;
  const name = nameOf(one);
  const drafts = sheet.drafts.map.value;
  const values = staged(drafts, key => sheet.held(key));
  const bad = wrong(drafts);
  const ramOnly = one.unsaved.filter(key => !values.has(key) && !bad.includes(key));
  const changed = changedKeys(sheet, uid);
  const tab = known ? openTab(known.tabs, hash, chosenTab.value) : "";
  const prediction = predict(key => willBe(sheet, key));
  const total = values.size + bad.length + ramOnly.length;
  const problem = sheet.trouble.value;
  const save = async () => {
    if (checking.peek()) return;
    checking.value = true;
    const why = await beginChange(saveChange(sheet, changed));
    if (why !== null) sheet.trouble.value = saving.notSaved(why);
    checking.value = false;
  };
  return (
    <>
      {known ? (
        <Tabs
          sheet={sheet}
          tabs={known.tabs}
          chosen={tab}
          onChoose={key => changeChoices({ tab: key === known.tabs[0]?.key ? "" : key }, "")}
          pwm={one.pwm}
        >
          <TorqueOff uid={uid} />
          <Search label={text.params.search} at={wanted} />
          <Segments<Filter>
            label={text.params.filter}
            chosen={filter.value}
            onChoose={key => {
              filter.value = key;
            }}
            options={[
              { key: "all", label: text.params.all },
              { key: "changed", label: text.params.changed(total) },
              { key: "favourites", label: text.params.favourites },
            ]}
          />
        </Tabs>
      ) : (
        <div class="tabs" />
      )}
      <div class="split">
        {!(narrow.value && tab === LIVE_TAB) && (
          <ParameterRows
            sheet={sheet}
            tab={tab}
            hash={hash}
            wanted={wanted}
            changedOnly={filter.value === "changed"}
            favouritesOnly={filter.value === "favourites"}
            onRetry={() => void apply(sheet)}
          />
        )}
        {(!narrow.value || tab === LIVE_TAB) && <SidePanel uid={uid} />}
      </div>
      <LostLine sheet={sheet} one={one} />
      <UndoLine sheet={sheet} one={one} />
      {(total > 0 || problem !== null) && (
        <SaveBar
          name={name}
          staged={values.size}
          wrong={bad.length}
          ramOnly={ramOnly.length}
          torqueChanged={values.has("torque_mode") || one.unsaved.includes("torque_mode")}
          sideEffect={sideEffect(prediction, name)}
          busy={checking.value ? "checking" : sheet.busy.value}
          online={one.online}
          changing={underWay([uid])}
          problem={problem}
          onDiscard={() => {
            sheet.drafts.clear();
            sheet.setOutcomes([...sheet.outcomes.peek().keys()].map(key => [key, null]));
            sheet.trouble.value = null;
          }}
          onDiff={() => {
            diff.value = true;
          }}
          onApply={() => void apply(sheet)}
          onSave={() => void save()}
        />
      )}
      {diff.value && (
        <DiffDialog
          sheet={sheet}
          name={name}
          keys={changed}
          onClose={() => {
            diff.value = false;
          }}
        />
      )}
    </>
  );
}

/** Staged and valid, or in RAM only: the rows of a save, in the order of the table. */
function changedKeys(sheet: Sheet, uid: string): string[] {
  const values = staged(sheet.drafts.map.value, key => sheet.held(key));
  const keys = new Set([...values.keys(), ...(servo(uid)?.unsaved ?? [])]);
  const order = [...(catalog.value?.rows.keys() ?? [])];
  return [...keys].sort((a, b) => order.indexOf(a) - order.indexOf(b));
}
