/** The Parameters page of one servo: head, tabs, rows, live panel, save bar and its dialogs. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import type { SavePreview } from "../api/config-types";
import { catalog } from "../bench/catalog";
import { staged, wrong } from "../bench/draft";
import { nameOf, servo } from "../bench/fleet";
import { onKey } from "../bench/keys";
import { connection } from "../bench/link";
import { type Sheet, sheetOf } from "../bench/parameters";
import { changeChoices, oneInAddress, wordInAddress } from "../bench/route";
import { narrow } from "../bench/screen";
import { apply, applyAndSave, lastWritten, planSave, saving, sheetProblem } from "../change/apply";
import { willBe } from "../change/change-list";
import { AskBackDialog, askingIn, type WriteQuestion } from "../change/confirm-write";
import { DryRun } from "../change/dry-run";
import { JobDialog } from "../change/job-dialog";
import { SaveBar } from "../change/save-bar";
import { DiffDialog, SaveDialog } from "../change/save-dialogs";
import { UndoLine } from "../change/undo";
import { Search } from "../kit/search";
import { Segments } from "../kit/segments";
import { ServoHead } from "../servo/head";
import { SidePanel } from "../servo/side-panel";
import { text } from "../text";
import { LIVE_TAB, openTab, Tabs } from "./group-tabs";
import { LostLine } from "./lost-values";
import { predict, sideEffect } from "./prediction";
import { ParameterRows } from "./rows";
import { TorqueOff } from "./torque-off";

const FILTERS = ["all", "changed"] as const;
type Filter = (typeof FILTERS)[number];

const wanted = wordInAddress("q");
const filter = oneInAddress("filter", FILTERS);
const chosenTab = wordInAddress("tab");

export function ParametersPage({ uid, hash }: { uid: string; hash: string }) {
  const sheet = sheetOf(uid);
  const one = servo(uid);
  const diff = useSignal(false);
  const saveRun = useMemo(() => new DryRun<SavePreview>(), [uid]);
  const question = useSignal<WriteQuestion | null>(null);
  const askBack = useMemo(() => askingIn(question), []);
  const round = connection.value;
  const ready = one?.online === true && one.state !== "identifying" && one.state !== "restarting";

  // Read anew after each connection, restart and identification.
  useEffect(() => {
    if (round > 0) void sheet.load();
  }, [uid, round, ready]);
  useEffect(() => {
    // What was saved or refused on the last visit is no news on this one.
    if (sheet.busy.peek() === null) sheet.outcomes.value = new Map();
    lastWritten.value = null;
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
  const refused = saveRun.problem.value === null ? null : text.save.notSaved(saveRun.problem.value);
  const problem = sheetProblem.value?.uid === uid ? sheetProblem.value.text : refused;
  return (
    <div class="page">
      <ServoHead one={one}>
        <TorqueOff uid={uid} />
      </ServoHead>
      {known && (
        <Tabs
          sheet={sheet}
          tabs={known.tabs}
          chosen={tab}
          onChoose={key => changeChoices({ tab: key === known.tabs[0]?.key ? "" : key }, "")}
          pwm={one.pwm}
        >
          <Search
            label={text.params.search}
            value={wanted.value}
            onInput={value => {
              wanted.value = value;
            }}
          />
          <Segments<Filter>
            label={text.params.filter}
            chosen={filter.value}
            onChoose={key => {
              filter.value = key;
            }}
            options={[
              { key: "all", label: text.params.all },
              { key: "changed", label: text.params.changed(total) },
            ]}
          />
        </Tabs>
      )}
      <div class="split">
        {!(narrow.value && tab === LIVE_TAB) && (
          <ParameterRows
            sheet={sheet}
            tab={tab}
            hash={hash}
            wanted={wanted}
            changedOnly={filter.value === "changed"}
            onRetry={() => void apply(sheet, { askBack })}
          />
        )}
        {(!narrow.value || tab === LIVE_TAB) && <SidePanel uid={uid} />}
      </div>
      <LostLine sheet={sheet} one={one} />
      <UndoLine sheet={sheet} one={one} name={name} askBack={askBack} />
      {(total > 0 || problem !== null) && (
        <SaveBar
          name={name}
          staged={values.size}
          wrong={bad.length}
          ramOnly={ramOnly.length}
          torqueChanged={values.has("torque_mode") || one.unsaved.includes("torque_mode")}
          sideEffect={sideEffect(prediction, name)}
          busy={saveRun.busy.value ? "checking" : sheet.busy.value}
          online={one.online}
          problem={problem}
          onDiscard={() => {
            sheet.drafts.clear();
            sheet.setOutcomes([...sheet.outcomes.peek().keys()].map(key => [key, null]));
            sheetProblem.value = null;
          }}
          onDiff={() => {
            diff.value = true;
          }}
          onApply={() => void apply(sheet, { askBack })}
          onSave={() => {
            sheetProblem.value = null;
            void saveRun.open(confirm => planSave(sheet, confirm), askBack);
          }}
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
      {saveRun.plan.value && (
        <SaveDialog
          one={one}
          plan={saveRun.plan.value}
          onClose={() => saveRun.close()}
          onConfirm={() => {
            saveRun.close();
            void applyAndSave(sheet, changed, saveRun.confirm);
          }}
        />
      )}
      {question.value && <AskBackDialog name={name} count={values.size} question={question.value} />}
      {saving.value && <JobDialog uid={uid} />}
    </div>
  );
}

/** Staged and legal, or in RAM only: what a save would put into ROM, in the order of the rows. */
function changedKeys(sheet: Sheet, uid: string): string[] {
  const values = staged(sheet.drafts.map.value, key => sheet.held(key));
  const keys = new Set([...values.keys(), ...(servo(uid)?.unsaved ?? [])]);
  const order = [...(catalog.value?.rows.keys() ?? [])];
  return [...keys].sort((a, b) => order.indexOf(a) - order.indexOf(b));
}
