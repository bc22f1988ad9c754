/** The dialog about what somebody else changed in a servo's ROM: the difference, restore, accept. */
import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { ask, type Problem, problemOf } from "../api/client";
import type { Drift, SafetyWord, SavePreview } from "../api/config-types";
import type { ParametersPatched } from "../api/types";
import { Asked, saved } from "../bench/asked";
import { openDrift } from "../bench/drift-open";
import { nameOf, servo } from "../bench/fleet";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { records as words } from "../text/topics";
import { ConfirmTicks } from "./confirm-ticks";
import { whyRefused } from "./consequences";
import { AfterSave, useFreeAfterSave } from "./horn-free";
import { isOpen, wordsOf } from "./safety-words";
import "./change.css";

const said = words.drift;
const write = words.write;

export function DriftDialog() {
  const uid = openDrift.value;
  return uid === null ? null : <Shown key={uid} uid={uid} />;
}

function Shown({ uid }: { uid: string }) {
  const one = servo(uid);
  const name = nameOf(one);
  const drift = useMemo(() => new Asked<Drift>(), []);
  const save = useSignal(false);
  const busy = useSignal<"writing" | "saving" | null>(null);
  const problem = useSignal<string | null>(null);
  const needed = useSignal<readonly SafetyWord[]>([]);
  const agreed = useSignal<readonly SafetyWord[]>([]);
  /** What a restore with a save would do, as far as the server agrees to it. */
  const plan = useSignal<SavePreview | null>(null);
  const checked = useSignal(false);
  const load = () => drift.load(() => ask<Drift>("GET", `/servos/${uid}/drift`));
  useEffect(() => {
    void load().then(check);
  }, []);
  const close = () => {
    openDrift.value = null;
  };
  /** Asks whether these values could be written back now; with `save`, what that would do. */
  const check = async () => {
    const found = drift.value.peek()?.rows ?? [];
    checked.value = false;
    plan.value = null;
    problem.value = null;
    if (found.length === 0) return;
    try {
      const answer = await ask<ParametersPatched>("PATCH", `/servos/${uid}/parameters`, {
        body: {
          values: Object.fromEntries(found.map(row => [row.key, row.was])),
          dry_run: true,
          save: save.peek(),
          confirm: agreed.peek(),
        },
        timeout_ms: 30_000,
      });
      if (save.peek()) plan.value = answer;
      checked.value = true;
    } catch (error) {
      refuse(problemOf(error));
    }
  };
  const refuse = (found: Problem) => {
    needed.value = [...new Set([...needed.peek(), ...wordsOf(found)])];
    problem.value = whyRefused(found);
  };
  const doing = async (act: () => Promise<string | null>) => {
    busy.value = "writing";
    problem.value = null;
    try {
      problem.value = await act();
      if (problem.value === null) return close();
    } catch (error) {
      refuse(problemOf(error));
    } finally {
      busy.value = null;
    }
    await load();
  };
  const restore = () =>
    doing(async () => {
      const answer = await ask<ParametersPatched>("POST", `/servos/${uid}/drift/restore`, {
        body: { save: save.peek(), confirm: agreed.peek() },
        timeout_ms: 60_000,
      });
      if (answer.outcome === "rolled_back") return write.rolledBack(answer.failure ?? "");
      if (answer.job == null) return answer.failure == null ? null : write.unsaved(answer.failure);
      busy.value = "saving";
      const failure = await saved(answer.job);
      return failure === null ? null : write.unsaved(failure);
    });
  const accept = () =>
    doing(async () => {
      await ask<void>("DELETE", `/servos/${uid}/drift`);
      return null;
    });
  const rows = drift.value.value?.rows ?? [];
  const saves = plan.value === null ? [] : [{ uid, restart: plan.value.restart ?? null }];
  const free = useFreeAfterSave(saves);
  const idle = busy.value === null;
  const unmet = isOpen(needed.value, agreed.value);
  const again = !checked.value && needed.value.length > 0 && !unmet;
  const why = problem.value ?? drift.problem.value;
  return (
    <Dialog
      title={said.title(name)}
      subtitle={said.lead}
      testid="drift-dialog"
      onClose={close}
      foot={
        <>
          {!idle && (
            <span class="k-intent working">
              <Spinner /> {busy.value === "saving" ? write.saving : write.working}
            </span>
          )}
          <span class="grow" />
          <span data-first-focus>
            <Button onClick={close}>{text.cancel}</Button>
          </span>
          <Button
            live
            testid="drift-accept"
            disabled={!idle || rows.length === 0}
            onClick={() => void accept()}
          >
            {said.accept}
          </Button>
          <Button
            look="primary"
            live
            testid="drift-restore"
            disabled={
              !idle ||
              rows.length === 0 ||
              unmet ||
              !(checked.value || again) ||
              !free.agreed ||
              one?.online !== true
            }
            onClick={() => void (again ? check() : restore())}
          >
            {again ? words.again : said.restore(rows.length)}
          </Button>
        </>
      }
    >
      {why !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {why}
        </p>
      )}
      {drift.value.value !== null && rows.length === 0 && <p>{said.none}</p>}
      {rows.length > 0 && (
        <table class="changes">
          <thead>
            <tr>
              <th>{said.head.parameter}</th>
              <th class="right">{said.head.was}</th>
              <th class="right">{said.head.now}</th>
            </tr>
          </thead>
          <tbody>
            {rows.map(row => (
              <tr key={row.key} data-testid={`drift-${row.key}`}>
                <td>
                  {rowLabelOf(row.key)} <small class="second">{addressOf(row.key)}</small>
                  {!row.proved && <small class="r-under">{said.assumed}</small>}
                </td>
                <td class="right">{valueText(row.key, row.was)}</td>
                <td class="right strong k-warning">{valueText(row.key, row.now)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      <ConfirmTicks needed={needed.value} agreed={agreed} sentences={write.confirm} />
      {rows.length > 0 && (
        <label class="tick">
          <input
            type="checkbox"
            data-testid="drift-save"
            checked={save.value}
            onChange={event => {
              save.value = event.currentTarget.checked;
              void check();
            }}
          />
          {said.save}
        </label>
      )}
      {rows.length > 0 && !save.value && <p class="small second">{said.ramOnly}</p>}
      <AfterSave saves={saves} free={free} />
    </Dialog>
  );
}
