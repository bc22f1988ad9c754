/** Actions on a servo: output, values, files; factory reset alone at the foot. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { API, callApi, problemOf } from "../api/client";
import { stopped } from "../bench/bench";
import { catalog } from "../bench/catalog";
import { staged, wrong } from "../bench/draft";
import { problemText } from "../bench/facts";
import { all, type KnownServo, nameOf } from "../bench/fleet";
import { clock } from "../bench/format";
import { up } from "../bench/link";
import { outputLine } from "../bench/output";
import { sheetOf } from "../bench/parameters";
import { commanderOf, observing } from "../bench/role";
import { go, pathOf } from "../bench/route";
import { saveChange } from "../change/apply";
import { beginChange, type ChangeRequest } from "../change/flow";
import { resetChange, restartChange } from "../change/requests";
import { canRestore } from "../change/restorable";
import { planRestore } from "../change/restoring";
import { torqueOff } from "../change/torque";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Icon, type IconName } from "../kit/icon";
import { lazy } from "../kit/lazy";
import { Note } from "../kit/note";
import { text } from "../text";
import { Rename } from "./rename";
import { taken } from "./state";
import { overview as words } from "./words";

const ApplyProfile = lazy<{ uids: readonly string[]; onClose: () => void }>(() =>
  import("../change/choose-profile").then(file => file.ApplyProfile),
);

export function Act({ one }: { one: KnownServo }) {
  const { uid } = one;
  const problem = useSignal<string | null>(null);
  const profile = useSignal(false);
  const renaming = useSignal(false);
  const same = all.value.filter(each => each.model === one.model).map(each => each.uid);
  const away = !one.online;
  const begin = async (change: ChangeRequest) => {
    problem.value = null;
    problem.value = await beginChange(change);
  };
  const snapshot = async () => {
    problem.value = null;
    try {
      const { at } = await callApi("POST", "/servos/{uid}/snapshots", {
        path: { uid },
        body: { reason: "" },
      });
      taken.value = { uid, at };
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
  };
  // Controls that write are absent.
  const writes = !observing.value;
  return (
    <section class="o-act" data-testid="overview-actions">
      {writes ? (
        <>
          <Output one={one} onProblem={why => (problem.value = why)} />
          <Row
            icon="wiggle"
            testid="act-restart"
            note={words.restartLine}
            disabled={away}
            onClick={() => void begin(restartChange([uid]))}
          >
            {words.restart}
          </Row>
        </>
      ) : (
        <Note kind="notice" testid="act-observer">
          {text.motion.whileObserving}
        </Note>
      )}
      <Row icon="pencil" testid="act-rename" onClick={() => (renaming.value = true)}>
        {words.rename}
      </Row>
      <h2>{words.values}</h2>
      {writes && <Save one={one} onSave={() => void begin(saveChange(sheetOf(uid), one.unsaved))} />}
      <Row
        icon="copy"
        testid="act-compare"
        note={words.compareLine(same.length)}
        onClick={() => go(pathOf("matrix", null, "", { uids: same.join(",") }))}
      >
        {words.compare}
      </Row>
      {writes && (
        <>
          <Row icon="parameters" testid="act-profile" disabled={away} onClick={() => (profile.value = true)}>
            {words.profile}
          </Row>
          <Row
            icon="records"
            testid="act-snapshot"
            disabled={away}
            note={taken.value?.uid === uid ? words.taken(clock(taken.value.at)) : undefined}
            onClick={() => void snapshot()}
          >
            {words.snapshot}
          </Row>
        </>
      )}
      {problem.value !== null && (
        <p class="o-trouble small" role="alert">
          <Glyph kind="failure" size={14} /> {problem.value}
        </p>
      )}
      <h2>{words.files}</h2>
      <a
        class="o-row"
        href={`${API}/servos/${uid}/telemetry.csv`}
        download=""
        data-testid="act-export"
        aria-disabled={!up.value}
      >
        <Icon name="download" /> {words.export}
      </a>
      <Row icon="play" testid="act-record" onClick={() => go(pathOf("recorder", null))}>
        {words.record}
      </Row>
      {writes && (
        <div class="o-severe">
          <Button
            live
            look="danger"
            testid="act-factory-reset"
            disabled={away}
            onClick={() => void begin(resetChange(uid, nameOf(one)))}
          >
            {words.reset}
          </Button>
          <small class="second">{words.resetLine}</small>
        </div>
      )}
      {renaming.value && <Rename one={one} onClose={() => (renaming.value = false)} />}
      {profile.value && <ApplyProfile uids={[uid]} onClose={() => (profile.value = false)} />}
    </section>
  );
}

/** Torque mode. Off and Brake act immediately; On follows the usual steps. */
function Output({ one, onProblem }: { one: KnownServo; onProblem: (why: string | null) => void }) {
  const { state } = one.output;
  const on = async () => onProblem(await planRestore([one.uid]));
  const away = async (mode: "off" | "brake") => onProblem(await torqueOff(one.uid, mode));
  const brakes = catalog.value?.rows.get("torque_mode")?.choices?.some(each => each.key === "brake") === true;
  const by = commanderOf(one);
  const why = by
    ? text.motion.whileCommanded(nameOf(one), by.node_id)
    : !one.online
      ? words.awayLine
      : stopped.value
        ? words.stoppedLine
        : !one.known_model || !brakes
          ? words.noBrake
          : "";
  return (
    <>
      <h2>{words.output}</h2>
      <div class="segments" role="group" aria-label={words.output} data-testid="act-output">
        <button
          type="button"
          aria-pressed={state === "on"}
          disabled={state !== "on" && (!up.value || stopped.value || by !== undefined || !canRestore(one))}
          onClick={() => state !== "on" && void on()}
        >
          {words.on}
        </button>
        <button
          type="button"
          aria-pressed={state === "off"}
          disabled={state !== "off" && (!up.value || by !== undefined || !one.online)}
          onClick={() => state !== "off" && void away("off")}
        >
          {state === "off" && stopped.value ? words.stopped : words.off}
        </button>
        <button
          type="button"
          aria-pressed={state === "brake"}
          disabled={state !== "brake" && (!up.value || why !== "")}
          title={why || words.brakeLine}
          onClick={() => state !== "brake" && void away("brake")}
        >
          {words.brake}
        </button>
      </div>
      <p class="small second">{by ? why : outputLine(one.output)}</p>
    </>
  );
}

function Save({ one, onSave }: { one: KnownServo; onSave: () => void }) {
  const sheet = sheetOf(one.uid);
  const drafts = sheet.drafts.map.value;
  const waiting = staged(drafts, key => sheet.held(key)).size + wrong(drafts).length;
  const n = one.unsaved.length;
  if (waiting > 0)
    return (
      <Row icon="pencil" testid="act-staged" onClick={() => go(pathOf("parameters", one.uid))}>
        {words.staged(waiting)}
      </Row>
    );
  if (n === 0)
    return (
      <p class="o-row" data-testid="act-saved">
        <Icon name="tick" /> {words.allSaved}
      </p>
    );
  return (
    <Button
      live
      look="two primary"
      testid="act-save"
      disabled={!one.online || sheet.busy.value !== null}
      onClick={onSave}
    >
      <b>{words.save(n)}</b>
      <small>{words.saveLine(nameOf(one))}</small>
    </Button>
  );
}

interface RowProps {
  icon: IconName;
  testid: string;
  onClick: () => void;
  note?: string | undefined;
  disabled?: boolean;
  children: ComponentChildren;
}

function Row({ icon, testid, onClick, note, disabled = false, children }: RowProps) {
  return (
    <button
      type="button"
      class="o-row"
      data-testid={testid}
      disabled={disabled || !up.value}
      onClick={onClick}
    >
      <Icon name={icon} /> <span>{children}</span>
      {note && <small>{note}</small>}
    </button>
  );
}
