/** What stands between staged cells and servos: the changes as the server plans them, what moves, and the results. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { problemOf } from "../api/client";
import type { BatchOutcome, SafetyWord } from "../api/config-types";
import type { ProblemBody } from "../api/types";
import { endText, problemText } from "../bench/facts";
import { nameOf, peekServo } from "../bench/fleet";
import { asProblem } from "../bench/parameters";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { editing, matrix } from "../text/topics";
import { startSave } from "./apply";
import { changed, endOfSave, planSaves, stagedOn, writeMatrix } from "./batch";
import { PlannedServo, type Result, ResultLine } from "./batch-result";
import { ConfirmTicks } from "./confirm-ticks";
import { whyRefused } from "./consequences";
import { AfterSave, useFreeAfterSave } from "./horn-free";
import { isOpen, wordsOf } from "./safety-words";

const said = matrix.plan;

interface Props {
  uids: readonly string[];
  /** Nothing is written: what RAM of all of them holds goes into ROM. */
  saveOnly: boolean;
  onClose: () => void;
  /** Told why nothing can be confirmed: then no dialog has been open. */
  onRefused: (why: string) => void;
}

type Phase = "asking" | "ready" | "writing" | "saving" | "done";

export function PlanDialog({ uids, saveOnly, onClose, onRefused }: Props) {
  // What was staged when the dialog opened is what it is about.
  const values = useMemo(() => stagedOn(uids), []);
  const concerned = useMemo(
    () => (saveOnly ? uids.filter(uid => peekServo(uid)?.online === true) : [...values.keys()]),
    [],
  );
  const phase = useSignal<Phase>("asking");
  // Null until the first dry run: there is no dialog before it has gone through.
  const plan = useSignal<readonly BatchOutcome[] | null>(null);
  const results = useSignal<ReadonlyMap<string, Result>>(new Map());
  const wrong = useSignal<string | null>(null);
  const save = useSignal(saveOnly);
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const asked = useSignal<readonly SafetyWord[]>([]);

  const look = async () => {
    phase.value = "asking";
    wrong.value = null;
    const confirm = agreed.peek();
    try {
      const found = await (saveOnly
        ? planSaves(concerned, confirm)
        : writeMatrix(values, { dry_run: true, save: save.peek(), confirm }));
      const problems = found.flatMap(one => (one.problem ? [{ uid: one.uid, ...askedBy(one.problem) }] : []));
      const first = problems[0];
      // Nobody is left, and nothing that could be agreed to would help.
      if (
        plan.peek() === null &&
        first &&
        problems.length === found.length &&
        !problems.some(one => one.words.length)
      ) {
        return onRefused(said.refusedAll(nameOf(peekServo(first.uid)), first.why, problems.length));
      }
      plan.value = found;
      asked.value = [...new Set([...asked.peek(), ...problems.flatMap(one => one.words)])];
    } catch (error) {
      const why = problemText(problemOf(error));
      if (plan.peek() === null) return onRefused(why);
      wrong.value = why;
    }
    phase.value = "ready";
  };
  useEffect(() => {
    void look();
  }, []);

  const planned = plan.value ?? [];
  const passed = planned.filter(one => one.outcome === "planned");
  const able = passed.map(one => one.uid);
  const open = isOpen(asked.value, agreed.value);
  // A tick is worth something only once the server was asked again with it.
  const stale = planned.some(
    one => one.problem && askedBy(one.problem).words.some(word => agreed.value.includes(word)),
  );
  const saves = save.value && phase.value !== "asking" ? passed : [];
  const free = useFreeAfterSave(saves);

  const put = (uid: string, result: Result) => {
    results.value = new Map(results.peek()).set(uid, result);
  };
  const follow = async (uid: string, job: string, count: number) => {
    put(uid, { state: "working", text: said.saving });
    const keys = [...new Set([...(values.get(uid)?.keys() ?? []), ...(peekServo(uid)?.unsaved ?? [])])];
    const end = await endOfSave(uid, job, keys);
    const why = endText(end);
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
        const why = one.problem ? problemText(asProblem(one.problem)) : "";
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
          await follow(uid, (await startSave(uid, agreed.peek())).id, 0);
        } catch (error) {
          const why = problemText(problemOf(error));
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
      wrong.value = problemText(problemOf(error));
      phase.value = "ready";
    }
  };

  if (plan.value === null) return null;
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
          {!over && asked.value.length > 0 && (open || stale) ? (
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
                disabled={busy || n === 0 || !free.agreed}
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
            <ResultLine key={uid} uid={uid} result={results.value.get(uid)} plan={planned} />
          ))}
        </ul>
      ) : (
        <>
          {planned.map(one => (
            <PlannedServo key={one.uid} one={one} save={save.value} />
          ))}
          <ConfirmTicks needed={asked.value} agreed={agreed} sentences={editing.confirm.ticks} />
          {!saveOnly && (
            <label class="tick">
              <input
                type="checkbox"
                data-testid="plan-save"
                disabled={busy}
                checked={save.value}
                onChange={event => {
                  save.value = event.currentTarget.checked;
                  void look();
                }}
              />
              {said.save}
            </label>
          )}
          {!save.value && <p class="small second">{said.ram}</p>}
          <AfterSave saves={saves} free={free} />
        </>
      )}
    </Dialog>
  );
}

/** A servo's problem in words, and what could be agreed to. */
function askedBy(body: ProblemBody): { why: string; words: readonly SafetyWord[] } {
  const problem = asProblem(body);
  return { why: whyRefused(problem), words: wordsOf(problem) };
}
