/** Owns the Parameters page of one servo: head, tabs, rows, live panel, save bar and its dialogs. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { willBe } from "../form/change-list";
import { predict, sideEffect } from "../form/prediction";
import { SaveBar } from "../form/save-bar";
import { apply, applyAndSave, lastWritten, saving, sheetProblem } from "../state/apply";
import { catalog } from "../state/catalog";
import { staged, wrong } from "../state/draft";
import { loaded, nameOf, servo } from "../state/fleet";
import { onKey } from "../state/keys";
import { connection } from "../state/link";
import { type Sheet, sheetOf } from "../state/parameters";
import { go, pathOf } from "../state/route";
import { narrow } from "../state/screen";
import { text } from "../text";
import { Button } from "../ui/button";
import { Search } from "../ui/search";
import { Segments } from "../ui/segments";
import { AskBackDialog, asking, type Question } from "./ask-back";
import { JobDialog } from "./job-dialog";
import { Rows } from "./parameter-rows";
import { DiffDialog, SaveDialog } from "./save-dialogs";
import { ServoHead } from "./servo-head";
import { SidePanel } from "./side-panel";
import { LIVE_TAB, Tabs } from "./tabs";
import { TorqueOff } from "./torque-off";
import { UndoLine } from "./undo";

type Filter = "all" | "changed";

export function ParametersPage({ uid, hash }: { uid: string; hash: string }) {
  const sheet = sheetOf(uid);
  const one = servo(uid);
  const wanted = useSignal("");
  const filter = useSignal<Filter>("all");
  const tab = useSignal("");
  const open = useSignal<"none" | "diff" | "save">("none");
  const question = useSignal<Question | null>(null);
  const askBack = useMemo(() => asking(question), []);
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
    const forget = [
      onKey("Ctrl+S", () => {
        if (changedKeys(sheet, uid).length > 0) open.value = "diff";
      }),
      onKey("Ctrl+Z", () => sheet.drafts.undo()),
    ];
    return () => {
      for (const one of forget) one();
    };
  }, [uid]);

  const known = catalog.value;
  if (!one) {
    return (
      <div class="page">
        <p class="notice-line">
          {loaded.value ? text.params.unknownServo : text.params.reading}{" "}
          {loaded.value && <Button onClick={() => go(pathOf("servos", null))}>{text.params.toServos}</Button>}
        </p>
      </div>
    );
  }
  const name = nameOf(one);
  const drafts = sheet.drafts.map.value;
  const values = staged(drafts, key => sheet.held(key));
  const bad = wrong(drafts);
  const ramOnly = one.unsaved.filter(key => !values.has(key) && !bad.includes(key));
  const changed = changedKeys(sheet, uid);
  const prediction = predict(key => willBe(sheet, key));
  const total = values.size + bad.length + ramOnly.length;
  const problem = sheetProblem.value?.uid === uid ? sheetProblem.value.text : null;
  const close = () => {
    open.value = "none";
  };
  return (
    <div class="page">
      <ServoHead one={one} page="parameters">
        <TorqueOff uid={uid} />
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
      </ServoHead>
      {known && <Tabs sheet={sheet} tabs={known.tabs} chosen={tab} hash={hash} pwm={one.pwm} />}
      <div class="split">
        {!(narrow.value && tab.value === LIVE_TAB) && (
          <Rows
            sheet={sheet}
            tab={tab}
            hash={hash}
            wanted={wanted}
            changedOnly={filter.value === "changed"}
            onRetry={() => void apply(sheet, { askBack })}
          />
        )}
        {(!narrow.value || tab.value === LIVE_TAB) && <SidePanel uid={uid} />}
      </div>
      <UndoLine sheet={sheet} name={name} online={one.online} askBack={askBack} />
      {(total > 0 || problem !== null) && (
        <SaveBar
          name={name}
          staged={values.size}
          wrong={bad.length}
          ramOnly={ramOnly.length}
          torqueChanged={values.has("torque_mode") || one.unsaved.includes("torque_mode")}
          sideEffect={sideEffect(prediction, name)}
          busy={sheet.busy.value}
          online={one.online}
          problem={problem}
          onDiscard={() => {
            sheet.drafts.clear();
            sheet.setOutcomes([...sheet.outcomes.peek().keys()].map(key => [key, null]));
            sheetProblem.value = null;
          }}
          onDiff={() => {
            open.value = "diff";
          }}
          onApply={() => void apply(sheet, { askBack })}
          onSave={() => {
            open.value = "save";
          }}
        />
      )}
      {open.value === "diff" && <DiffDialog sheet={sheet} name={name} keys={changed} onClose={close} />}
      {open.value === "save" && (
        <SaveDialog
          sheet={sheet}
          one={one}
          keys={changed}
          prediction={prediction}
          onClose={close}
          onConfirm={() => {
            close();
            void applyAndSave(sheet, changed, { askBack });
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
