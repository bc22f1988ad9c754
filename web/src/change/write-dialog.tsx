/** The dialog before rows are restored: what would change, whether it is saved, and what came of it. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { problemOf } from "../api/client";
import type { Restored, SafetyWord } from "../api/config-types";
import { saved } from "../bench/asked";
import { noteText } from "../bench/note-text";
import { rowLabelOf } from "../bench/row-text";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { records as words } from "../text/topics";
import { BeforeAfter } from "./before-after";
import { ConfirmTicks } from "./confirm-ticks";
import { whyRefused } from "./consequences";
import { AfterSave, useFreeAfterSave } from "./horn-free";
import { isOpen, wordsOf } from "./safety-words";
import "./change.css";

const said = words.write;

export interface WriteWish {
  dry_run: boolean;
  save: boolean;
  confirm: readonly SafetyWord[];
}

interface Props {
  uid: string;
  name: string;
  write: (wish: WriteWish) => Promise<Restored>;
  /** Told what was done; null when nothing was. */
  onClose: (note: string | null) => void;
  /** Told why it cannot be done: then no dialog has been open. */
  onRefused: (why: string) => void;
}

export function WriteDialog({ uid, name, write, onClose, onRefused }: Props) {
  const plan = useSignal<Restored | null>(null);
  const wrong = useSignal<string | null>(null);
  const needed = useSignal<readonly SafetyWord[]>([]);
  const agreed = useSignal<readonly SafetyWord[]>([]);
  const save = useSignal(false);
  const phase = useSignal<"planning" | "ready" | "writing" | "saving">("planning");
  const written = useSignal<string | null>(null);
  const shown = useSignal(false);

  const refuse = (error: unknown) => {
    const problem = problemOf(error);
    const words = wordsOf(problem);
    needed.value = [...new Set([...needed.peek(), ...words])];
    wrong.value = said.refused(whyRefused(problem));
    return words.length > 0;
  };
  const preview = async () => {
    phase.value = "planning";
    wrong.value = null;
    try {
      plan.value = await write({ dry_run: true, save: save.peek(), confirm: agreed.peek() });
      shown.value = true;
    } catch (error) {
      const asks = refuse(error);
      // What only wants a yes is asked for; anything else keeps the dialog from opening.
      if (!asks && !shown.peek()) return onRefused(wrong.peek() ?? "");
      shown.value = true;
    }
    phase.value = "ready";
  };
  useEffect(() => {
    void preview();
  }, []);

  const changes = plan.value?.changes.filter(one => one.verdict !== "unchanged") ?? [];
  const unchanged = (plan.value?.changes.length ?? 0) - changes.length;
  const leftOut = plan.value?.left_out ?? [];
  const saves =
    save.value && phase.value !== "planning" && plan.value
      ? [{ uid, restart: plan.value.restart ?? null }]
      : [];
  const free = useFreeAfterSave(saves);
  const unmet = isOpen(needed.value, agreed.value);
  const act = async () => {
    phase.value = "writing";
    wrong.value = null;
    try {
      const answer = await write({ dry_run: false, save: save.peek(), confirm: agreed.peek() });
      const count = answer.changes.filter(one => one.verdict !== "unchanged").length;
      if (answer.outcome === "rolled_back") {
        wrong.value = said.rolledBack(answer.failure ?? "");
      } else if (answer.job == null) {
        const note = said.done(count, name, false);
        if (answer.failure == null) return onClose(note);
        written.value = note;
        wrong.value = said.unsaved(answer.failure);
      } else {
        phase.value = "saving";
        const failure = await saved(answer.job);
        const note = said.done(count, name, failure === null);
        if (failure === null) return onClose(note);
        written.value = note;
        wrong.value = said.unsaved(failure);
      }
    } catch (error) {
      refuse(error);
    }
    phase.value = "ready";
  };
  if (!shown.value) return null;
  const busy = phase.value !== "ready";
  const inRom = save.value ? (plan.value?.rom_changes ?? []) : null;
  return (
    <Dialog
      title={said.title(name)}
      testid="write-dialog"
      onClose={() => onClose(written.peek())}
      foot={
        <>
          {busy && (
            <span class="k-intent working">
              <Spinner />
              {phase.value === "planning"
                ? said.planning
                : phase.value === "writing"
                  ? said.working
                  : said.saving}
            </span>
          )}
          <span class="grow" />
          <span data-first-focus>
            <Button onClick={() => onClose(written.peek())}>{text.cancel}</Button>
          </span>
          {(plan.value === null || (wrong.value !== null && phase.value === "ready")) &&
          needed.value.length > 0 ? (
            <Button look="primary" live disabled={busy || unmet} onClick={() => void preview()}>
              {words.again}
            </Button>
          ) : (
            <Button
              look="primary"
              live
              testid="write-confirm"
              disabled={busy || unmet || !free.agreed || (changes.length === 0 && !save.value)}
              onClick={() => void act()}
            >
              {said.go(changes.length, save.value)}
            </Button>
          )}
        </>
      }
    >
      {wrong.value !== null && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {wrong.value}
        </p>
      )}
      {plan.value !== null && changes.length === 0 && <p>{said.nothing}</p>}
      {changes.length > 0 && (
        <BeforeAfter
          head={{ parameter: said.head.parameter, now: said.head.now, next: said.head.target }}
          changes={changes.map(one => ({ key: one.key, now: one.before, next: one.requested }))}
          testid="plan"
        />
      )}
      {plan.value !== null && changes.length > 0 && unchanged > 0 && (
        <p class="small dim">{said.unchanged(unchanged)}</p>
      )}
      {leftOut.length > 0 && (
        <details>
          <summary>{said.leftOut(leftOut.length)}</summary>
          <ul class="r-left">
            {leftOut.map(one => (
              <li key={one.key}>
                {rowLabelOf(one.key)}:{" "}
                <span class="second">{noteText(one.why, one.why_code, one.why_params)}</span>
              </li>
            ))}
          </ul>
        </details>
      )}
      <ConfirmTicks needed={needed.value} agreed={agreed} sentences={said.confirm} />
      {plan.value !== null && (
        <label class="tick">
          <input
            type="checkbox"
            data-testid="write-save"
            checked={save.value}
            disabled={busy}
            onChange={event => {
              save.value = event.currentTarget.checked;
              void preview();
            }}
          />
          {said.save}
        </label>
      )}
      {plan.value !== null && !save.value && <p class="small second">{said.ram}</p>}
      {inRom !== null && inRom.length > 0 && (
        <BeforeAfter
          head={{ parameter: said.head.parameter, now: text.save.head.rom, next: text.save.head.after }}
          changes={inRom.map(one => ({ key: one.key, now: one.before, next: one.after }))}
          testid="rom"
        />
      )}
      <AfterSave saves={saves} free={free} />
    </Dialog>
  );
}
