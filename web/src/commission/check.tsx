/** The fourth step: changes per servo, what moves, and the button that starts the job. */
import { useEffect, useMemo } from "preact/hooks";
import type { CommissionPlan, SafetyWord } from "../api/config-types";
import { stopped } from "../bench/bench";
import { servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { wholeNumber } from "../bench/number";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { hornLine } from "../change/horn-forecast";
import { HornFree } from "../change/horn-free";
import { isOpen, withTick } from "../change/safety-words";
import { HornFreeTick } from "../change/ticks";
import { Button } from "../kit/button";
import { type Column, DataTable } from "../kit/data-table";
import { cell, Tick } from "../kit/field";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { Segments } from "../kit/segments";
import { changeDraft, count, draft, type Entry, wanted } from "./draft";
import { Actions, StepQuestion } from "./parts";
import { plan, plans, profiles, start, starting, startRefused } from "./state";
import { commission as words } from "./words";

const strings = words.check;

export function CheckStep() {
  const present = draft.value;
  const uids = wanted(present);
  const agreed = present.confirm.join(" ");
  // Checked again after every change of the request: only a checked request can be started.
  useEffect(() => {
    void plan();
  }, [present.save, agreed]);
  useEffect(() => {
    if (draft.peek().profile !== null) void profiles.load();
  }, []);
  const known = plans.value;
  const free = useMemo(
    () =>
      new HornFree(() =>
        (draft.value.save ? wanted(draft.value) : []).map(uid => ({
          uid,
          restart: plans.value?.get(uid)?.restart,
        })),
      ),
    [],
  );
  const problem = startRefused.value;
  const needed = [...new Set([...present.confirm, ...(problem?.confirm ?? [])])];
  const unmet = isOpen(problem?.confirm ?? [], present.confirm);
  const agree = (word: SafetyWord, on: boolean) =>
    changeDraft({ confirm: withTick(present.confirm, word, on) });
  return (
    <>
      <StepQuestion title={strings.title}>
        <p>{strings.lead(uids.length)}</p>
      </StepQuestion>
      <Scroll label={strings.title} testid="check-step">
        {problem && (
          <Note
            band
            testid="start-refused"
            action={
              problem.uid !== null &&
              uids.includes(problem.uid) &&
              problem.confirm.length === 0 && (
                <Button onClick={() => toEntry(problem.uid ?? "")} testid="refused-change">
                  {strings.change}
                </Button>
              )
            }
          >
            <b>{strings.refused}</b> {problem.text}
          </Note>
        )}
        <DataTable
          label={strings.table}
          rows={uids.flatMap(uid => {
            const entry = present.entries[uid];
            return entry ? [{ ...entry, uid }] : [];
          })}
          id={entry => entry.uid}
          data={entry => ({ testid: `check-${entry.uid}` })}
          columns={columns(present.save)}
        />
        <p class="w-line second">
          {profileLine(present.profile)}
          {count(present).skipped > 0 && ` · ${strings.leftOut(count(present).skipped)}`}
        </p>
        <div class="c-options">
          <Tick
            label={strings.save}
            at={cell(present.save, save => changeDraft({ save }))}
            class="tick big"
            testid="save"
          />
          <p class="second">{present.save ? strings.saveLine : strings.noSaveLine}</p>
          {uids.length > 1 && (
            <div class="c-option">
              <span>{strings.anomaly}</span>
              <Segments
                label={strings.anomaly}
                chosen={present.onAnomaly}
                onChoose={onAnomaly => changeDraft({ onAnomaly })}
                options={[
                  { key: "stop", label: strings.stop },
                  { key: "continue", label: strings.goOn },
                ]}
              />
            </div>
          )}
          {needed.map(word => (
            <Tick
              key={word}
              label={strings.confirm[word]}
              at={cell(present.confirm.includes(word), on => agree(word, on))}
              class="tick big"
              testid={`confirm-${word}`}
            />
          ))}
          <HornFreeTick of={free} big />
        </div>
      </Scroll>
      <Actions>
        <Button onClick={() => changeDraft({ step: "profile" })}>{words.back}</Button>
        <span class="grow second">{stopped.value && words.identify.stopped}</span>
        <Button
          look="primary"
          live
          testid="start"
          disabled={
            starting.value || known === null || unmet || stopped.value || !free.agreed || uids.length === 0
          }
          onClick={() => void start()}
        >
          {starting.value && <Spinner />}
          {strings.go(uids.length)}
        </Button>
      </Actions>
    </>
  );
}

function toEntry(uid: string): void {
  const entry = draft.peek().entries[uid];
  if (!entry) return;
  changeDraft({
    step: "identify",
    at: uid,
    entries: { ...draft.peek().entries, [uid]: { ...entry, state: "open" } },
  });
}

function profileLine(name: string | null): string {
  if (name === null) return strings.noProfile;
  const found = profiles.value.value?.find(one => one.name === name);
  return strings.profile(name, Object.keys(found?.values ?? {}).length);
}

const columns = (save: boolean): readonly Column<Entry & { uid: string }>[] => [
  {
    key: "servo",
    head: strings.head.servo,
    cell: ({ uid }) => {
      const one = servo(uid);
      return (
        <>
          <span class="strong c-serial">{one?.serial ?? one?.name ?? uid.slice(0, 8)}</span>
          <small>{one?.model}</small>
        </>
      );
    },
  },
  {
    key: "id",
    head: strings.head.id,
    right: true,
    look: () => "c-serial",
    cell: ({ uid, servoId }) => (
      <>
        <span class="second">{servo(uid)?.servo_id ?? NONE} → </span>
        <span class="strong k-intent">{wholeNumber(servoId)}</span>
      </>
    ),
  },
  {
    key: "node",
    head: strings.head.node,
    right: true,
    cell: ({ nodeId }) =>
      nodeId.trim() === "" ? (
        <span class="second">{strings.same}</span>
      ) : (
        <span class="strong k-intent">{wholeNumber(nodeId) || strings.keeps}</span>
      ),
  },
  {
    key: "name",
    head: strings.head.name,
    cell: ({ label }) =>
      label.trim() === "" ? (
        <span class="dim">{strings.noName}</span>
      ) : (
        <span class="strong k-intent">{label.trim()}</span>
      ),
  },
  {
    key: "changes",
    head: save ? strings.head.moves : strings.head.changes,
    cell: ({ uid }) => {
      const planned = plans.value?.get(uid);
      if (planned !== undefined) return <Planned of={planned} />;
      return (
        starting.value && (
          <span class="c-working dim">
            <Spinner /> {strings.reading}
          </span>
        )
      );
    },
  },
];

/** What the horn does, and every value that changes in ROM; without saving, every value written. */
function Planned({ of }: { of: CommissionPlan }) {
  const { save } = draft.value;
  const changes = save
    ? (of.rom_changes ?? [])
    : of.changes
        .filter(one => one.verdict !== "unchanged")
        .map(({ key, before, requested }) => ({ key, before, after: requested }));
  return (
    <>
      {of.restart && <span class={of.restart.moves ? "" : "second"}>{hornLine(of.restart)}</span>}
      <details data-testid={`changes-${of.uid}`}>
        <summary>{save ? strings.inRom(changes.length) : strings.inRam(changes.length)}</summary>
        <ul class="small">
          {changes.map(({ key, before, after }) => (
            <li key={key} data-key={key}>
              {rowLabelOf(key)} <span class="dim">{addressOf(key)}</span>: {valueText(key, before)} →{" "}
              <b>{valueText(key, after)}</b>
            </li>
          ))}
        </ul>
      </details>
    </>
  );
}
