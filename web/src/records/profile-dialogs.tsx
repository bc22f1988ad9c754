/** The two ways a profile comes to be: taken from a servo, or imported from a file, line by line. */

import { useSignal } from "@preact/signals";
import { useId } from "preact/hooks";
import { ask, problemOf } from "../api/client";
import type { Imported, LineVerdict, Profile } from "../api/config-types";
import { nameFromFile, typeOfFile } from "../bench/asked";
import { problemText } from "../bench/facts";
import { all, nameOf } from "../bench/fleet";
import { noteText } from "../bench/note-text";
import { rowLabelOf, valueText } from "../bench/row-text";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Choice } from "../kit/loaded";
import { text } from "../text";
import { records as words } from "../text/topics";

const said = words.profiles;
const LONGEST = 80;

interface Props {
  names: readonly string[];
  onClose: (note: string | null) => void;
}

function nameOk(name: string): boolean {
  return name.trim() !== "" && !/[/\\]/.test(name);
}

interface FieldProps {
  label: string;
  value: string;
  testid: string;
  hint?: string;
  longest: number;
  onInput: (value: string) => void;
}

function TextField({ label, value, testid, hint, longest, onInput }: FieldProps) {
  const id = useId();
  return (
    <div class="r-field">
      <label for={id}>{label}</label>
      <input
        id={id}
        class="field"
        data-testid={testid}
        autocomplete="off"
        maxLength={longest}
        placeholder={hint}
        value={value}
        onInput={event => onInput(event.currentTarget.value)}
      />
    </div>
  );
}

function Refusal({ why }: { why: string | null }) {
  if (why === null) return null;
  return (
    <p class="refusal" role="alert">
      <Glyph kind="failure" size={14} /> {why}
    </p>
  );
}

export function CreateDialog({ names, onClose }: Props) {
  const online = all.value.filter(one => one.online && one.model !== null);
  const name = useSignal("");
  const description = useSignal("");
  const from = useSignal(online[0]?.uid ?? "");
  const problem = useSignal<string | null>(null);
  const busy = useSignal(false);
  const make = async () => {
    busy.value = true;
    problem.value = null;
    try {
      const kept = await ask<Profile>("PUT", `/profiles/${encodeURIComponent(name.peek().trim())}`, {
        body: { from_uid: from.peek(), description: description.peek().trim() },
        timeout_ms: 30_000,
      });
      onClose(said.made(kept.name));
    } catch (error) {
      problem.value = problemText(problemOf(error));
      busy.value = false;
    }
  };
  return (
    <Dialog
      title={said.createTitle}
      testid="create-dialog"
      onClose={() => onClose(null)}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={() => onClose(null)}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="create-confirm"
            disabled={busy.value || !nameOk(name.value) || from.value === ""}
            onClick={() => void make()}
          >
            {said.createConfirm}
          </Button>
        </>
      }
    >
      {online.length === 0 ? (
        <p>{said.nobody}</p>
      ) : (
        <Choice
          label={said.from}
          value={from.value}
          testid="create-from"
          options={online.map(one => ({ key: one.uid, label: `${nameOf(one)}, ${one.model}` }))}
          onChoose={uid => {
            from.value = uid;
          }}
        />
      )}
      <TextField
        label={said.name}
        hint={said.nameHint}
        value={name.value}
        longest={LONGEST}
        testid="profile-name"
        onInput={value => {
          name.value = value;
        }}
      />
      <TextField
        label={said.description}
        value={description.value}
        longest={1000}
        testid="profile-description"
        onInput={value => {
          description.value = value;
        }}
      />
      {names.includes(name.value.trim()) && <p class="second">{said.nameTaken(name.value.trim())}</p>}
      <Refusal why={problem.value} />
    </Dialog>
  );
}

export function ImportDialog({ names, onClose }: Props) {
  const file = useSignal<File | null>(null);
  const name = useSignal("");
  const lines = useSignal<readonly LineVerdict[]>([]);
  const problem = useSignal<string | null>(null);
  const busy = useSignal(false);
  const id = useId();
  const take = async () => {
    const chosen = file.peek();
    const type = chosen === null ? null : typeOfFile(chosen.name);
    if (chosen === null || type === null) return;
    busy.value = true;
    problem.value = null;
    lines.value = [];
    try {
      const answer = await ask<Imported>("PUT", `/profiles/${encodeURIComponent(name.peek().trim())}/file`, {
        file: { text: await chosen.text(), type },
      });
      onClose(said.imported(answer.profile?.name ?? name.peek(), answer.lines.length));
    } catch (error) {
      const found = problemOf(error);
      problem.value = problemText(found);
      if (Array.isArray(found.facts.lines)) lines.value = found.facts.lines as LineVerdict[];
    }
    busy.value = false;
  };
  const form = file.value === null ? null : typeOfFile(file.value.name);
  return (
    <Dialog
      title={said.importTitle}
      subtitle={said.importLead}
      testid="import-dialog"
      onClose={() => onClose(null)}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={() => onClose(null)}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="import-confirm"
            disabled={busy.value || form === null || !nameOk(name.value)}
            onClick={() => void take()}
          >
            {said.importConfirm}
          </Button>
        </>
      }
    >
      <div class="r-field">
        <label for={id}>{said.file}</label>
        <input
          id={id}
          type="file"
          class="field r-file"
          accept=".toml,.json"
          data-testid="import-file"
          onChange={event => {
            const chosen = event.currentTarget.files?.[0] ?? null;
            file.value = chosen;
            problem.value = null;
            lines.value = [];
            if (chosen) name.value = nameFromFile(chosen.name);
          }}
        />
      </div>
      <TextField
        label={said.name}
        hint={said.nameHint}
        value={name.value}
        longest={LONGEST}
        testid="import-name"
        onInput={value => {
          name.value = value;
        }}
      />
      {names.includes(name.value.trim()) && <p class="second">{said.nameTaken(name.value.trim())}</p>}
      <Refusal why={problem.value} />
      {lines.value.length > 0 && (
        <table class="changes" aria-label={said.lineHead.verdict}>
          <thead>
            <tr>
              <th class="right">{said.lineHead.line}</th>
              <th class="r-gap">{said.lineHead.key}</th>
              <th>{said.lineHead.verdict}</th>
            </tr>
          </thead>
          <tbody>
            {lines.value.map((one, place) => (
              <tr key={`${one.line}-${one.key}-${place}`} data-verdict={one.verdict}>
                <td class="right dim">{said.line(one.line)}</td>
                <td class="r-gap">
                  {rowLabelOf(one.key)} <small class="second">{valueText(one.key, one.value)}</small>
                </td>
                <td>
                  <span class={one.verdict === "ok" ? "k-ok" : "strong k-failure"}>
                    {said.verdict[one.verdict]}
                  </span>{" "}
                  {one.verdict !== "ok" && (
                    <small class="second">{noteText(one.text, one.code, one.params)}</small>
                  )}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </Dialog>
  );
}
