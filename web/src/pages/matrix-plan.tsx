/** Owns what stands between staged cells and servos: the changes as the server plans them, what moves, and the results. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { problemOf } from "../api/client";
import type { BatchOutcome, SafetyWord } from "../api/config-types";
import { loosesTorque, willBe } from "../form/change-list";
import { mayMove, predict, sideEffect } from "../form/prediction";
import { startSave } from "../state/apply";
import { nameOf, peekServo, servo } from "../state/fleet";
import { asProblem, changed, endOfSave, stagedOn, writeMatrix } from "../state/matrix";
import { sheetOf } from "../state/parameters";
import { toConfirm } from "../state/records";
import { text } from "../text";
import { editing, matrix } from "../text/topics";
import { Button } from "../ui/button";
import { Dialog } from "../ui/dialog";
import { Glyph } from "../ui/glyph";
import { Spinner } from "../ui/icon";
import { ConfirmTicks } from "./confirm-ticks";
import { PlannedServo, type Result, ResultLine } from "./matrix-result";

const said = matrix.plan;

interface Props {
  uids: readonly string[];
  /** Nothing is written: what RAM holds goes into ROM. */
  saveOnly: boolean;
  onClose: () => void;
}

type Phase = "asking" | "ready" | "writing" | "saving" | "done";

export function PlanDialog({ uids, saveOnly, onClose }: Props) {
  // What was staged when the dialog opened is what it is about.
  const values = useMemo(() => stagedOn(uids), []);
  const concerned = useMemo(
    () =>
      saveOnly
        ? uids.filter(uid => peekServo(uid)?.online === true && (peekServo(uid)?.unsaved.length ?? 0) > 0)
        : [...values.keys()],
    [],
  );
  const phase = useSignal<Phase>(saveOnly ? "ready" : "asking");
  const plan = useSignal<readonly BatchOutcome[]>([]);
  const results = useSignal<ReadonlyMap<string, Result>>(new Map());
  const wrong = useSignal<string | null>(null);
  const save = useSignal(saveOnly);
  const free = useSignal(false);
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const asked = useSignal<readonly SafetyWord[]>([]);

  const look = async () => {
    phase.value = "asking";
    wrong.value = null;
    try {
      plan.value = await writeMatrix(values, { dry_run: true, save: false, confirm: agreed.peek() });
      const wishes = plan.value.flatMap(one =>
        one.problem ? (toConfirm(asProblem(one.problem)) ?? []) : [],
      );
      asked.value = [...new Set([...asked.peek(), ...wishes])];
    } catch (error) {
      wrong.value = text.problem(problemOf(error));
    }
    phase.value = "ready";
  };
  useEffect(() => {
    if (!saveOnly) void look();
  }, []);

  const able = saveOnly ? concerned : plan.value.filter(one => one.outcome === "planned").map(one => one.uid);
  const open = asked.value.filter(word => !agreed.value.includes(word));
  // A tick is worth something only once the server was asked again with it.
  const stale = plan.value.some(one => {
    const word = one.problem ? toConfirm(asProblem(one.problem)) : null;
    return word !== null && agreed.value.includes(word);
  });
  // The server asks before a save that takes torque away at every start; here it is known beforehand.
  const looses = save.value && able.some(uid => loosesTorque(sheetOf(uid)));
  const needed: readonly SafetyWord[] = looses ? [...asked.value, "torque_off_in_rom"] : asked.value;
  const forecasts = able.map(uid => ({ uid, prediction: predict(key => willBe(sheetOf(uid), key)) }));
  const moves = save.value && forecasts.some(one => mayMove(one.prediction));

  const put = (uid: string, result: Result) => {
    results.value = new Map(results.peek()).set(uid, result);
  };
  const follow = async (uid: string, job: string, count: number) => {
    put(uid, { state: "working", text: said.saving });
    const keys = [...new Set([...(values.get(uid)?.keys() ?? []), ...(peekServo(uid)?.unsaved ?? [])])];
    const end = await endOfSave(uid, job, keys);
    const why = end.error?.detail ?? text.job.state[end.state];
    if (end.state === "succeeded") {
      put(uid, { state: "ok", text: saveOnly ? said.savedOnly : said.doneSaved(count) });
    } else put(uid, { state: "failure", text: saveOnly ? said.notSavedOnly(why) : said.notSaved(why) });
  };
  const write = async () => {
    const mine = new Map([...values].filter(([uid]) => able.includes(uid)));
    const outcomes = await writeMatrix(mine, {
      dry_run: false,
      save: save.peek(),
      confirm: agreed.peek(),
    });
    phase.value = "saving";
    await Promise.all(
      outcomes.map(async one => {
        const why = one.problem ? text.problem(asProblem(one.problem)) : "";
        const count = changed(one.changes).length;
        if (one.outcome === "rolled_back") put(one.uid, { state: "failure", text: said.rolledBack(why) });
        else if (one.outcome !== "applied") put(one.uid, { state: "failure", text: said.failed(why) });
        else if (one.job) await follow(one.uid, one.job, count);
        else if (one.problem) put(one.uid, { state: "failure", text: said.notSaved(why) });
        else put(one.uid, { state: "ok", text: said.done(count) });
      }),
    );
  };
  const saveAll = () =>
    Promise.all(
      able.map(async uid => {
        try {
          await follow(uid, (await startSave(uid, { confirm: agreed.peek() })).id, 0);
        } catch (error) {
          const why = text.problem(problemOf(error));
          put(uid, { state: "failure", text: said.notSavedOnly(why) });
        }
      }),
    );
  const act = async () => {
    phase.value = saveOnly ? "saving" : "writing";
    wrong.value = null;
    try {
      await (saveOnly ? saveAll() : write());
      phase.value = "done";
    } catch (error) {
      wrong.value = text.problem(problemOf(error));
      phase.value = "ready";
    }
  };

  const busy = phase.value !== "ready" && phase.value !== "done";
  const over = phase.value === "done";
  const told = results.value.size > 0 || over;
  const word =
    phase.value === "asking" ? said.asking : phase.value === "writing" ? said.writing : said.saving;
  const n = able.length;
  return (
    <Dialog
      title={saveOnly ? said.saveTitle(concerned.length) : said.title(concerned.length)}
      testid="plan-dialog"
      onClose={onClose}
      foot={
        <>
          {busy && (
            <span class="k-intent working">
              <Spinner /> {phase.value === "saving" && !save.value ? said.writing : word}
            </span>
          )}
          <span class="grow" />
          <span data-first-focus>
            <Button testid="plan-close" onClick={onClose}>
              {told ? text.close : text.cancel}
            </Button>
          </span>
          {!over && asked.value.length > 0 && (open.length > 0 || stale) ? (
            <Button
              look="primary"
              live
              testid="plan-again"
              disabled={busy || !stale}
              onClick={() => void look()}
            >
              {said.again}
            </Button>
          ) : (
            !over && (
              <Button
                look="primary"
                live
                testid="plan-go"
                disabled={
                  busy ||
                  n === 0 ||
                  (moves && !free.value) ||
                  (looses && !agreed.value.includes("torque_off_in_rom"))
                }
                onClick={() => void act()}
              >
                {saveOnly ? said.goSaveOnly(n) : save.value ? said.goSave(n) : said.go(n)}
              </Button>
            )
          )}
        </>
      }
    >
      {wrong.value !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {wrong.value}
        </p>
      )}
      {told ? (
        <ul class="m-results" aria-label={said.results}>
          {concerned.map(uid => (
            <ResultLine key={uid} uid={uid} result={results.value.get(uid)} plan={plan.value} />
          ))}
        </ul>
      ) : (
        <>
          {plan.value.map(one => (
            <PlannedServo key={one.uid} one={one} />
          ))}
          <ConfirmTicks needed={needed} agreed={agreed} sentences={editing.confirm.ticks} />
          {!saveOnly && phase.value !== "asking" && (
            <label class="tick">
              <input
                type="checkbox"
                data-testid="plan-save"
                checked={save.value}
                onChange={event => {
                  save.value = event.currentTarget.checked;
                }}
              />
              {said.save}
            </label>
          )}
          {!save.value && <p class="small second">{said.ram}</p>}
          {save.value && forecasts.length > 0 && (
            <div>
              <h3>{said.after}</h3>
              <ul class="m-forecast">
                {forecasts.map(one => (
                  <li key={one.uid}>{sideEffect(one.prediction, nameOf(servo(one.uid)))}</li>
                ))}
              </ul>
            </div>
          )}
          {moves && (
            <label class="tick">
              <input
                type="checkbox"
                data-testid="plan-free"
                checked={free.value}
                onChange={event => {
                  free.value = event.currentTarget.checked;
                }}
              />
              {said.free}
            </label>
          )}
        </>
      )}
    </Dialog>
  );
}
