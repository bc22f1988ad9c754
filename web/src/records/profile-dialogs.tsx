/** Dialogs that create a profile: from a servo, or from a file, entry by entry. */

import { useSignal } from "@preact/signals";
import { callApi, problemOf } from "../api/client";
import type { LineVerdict } from "../api/config-types";
import { all, nameOf } from "../bench/fleet";
import { noteText } from "../bench/note-text";
import { rowLabelOf, valueText } from "../bench/row-text";
import { Confirm } from "../kit/confirm";
import { DataTable } from "../kit/data-table";
import { type Cell, Choice, FilePick, TextField } from "../kit/field";
import { nameFromFile, typeOfFile } from "./addresses";
import { records as words } from "./words";

const strings = words.profiles;
const LONGEST = 80;

interface Props {
  names: readonly string[];
  onClose: (note: string | null) => void;
}

function nameOk(name: string): boolean {
  return name.trim() !== "" && !/[/\\]/.test(name);
}

interface NameProps {
  at: Cell<string>;
  names: readonly string[];
  testid: string;
}

function ProfileName({ at, names, testid }: NameProps) {
  const taken = names.includes(at.value.trim()) ? strings.nameTaken(at.value.trim()) : null;
  return (
    <TextField
      label={strings.name}
      hint={strings.nameHint}
      at={at}
      longest={LONGEST}
      help={taken}
      testid={testid}
    />
  );
}

export function CreateDialog({ names, onClose }: Props) {
  const online = all.value.filter(one => one.online && one.model !== null);
  const name = useSignal("");
  const description = useSignal("");
  const from = useSignal(online[0]?.uid ?? "");
  return (
    <Confirm
      title={strings.createTitle}
      verb={strings.createConfirm}
      ready={nameOk(name.value) && from.value !== ""}
      testid="create-dialog"
      actId="create-confirm"
      act={async () => {
        const kept = await callApi("PUT", "/profiles/{name}", {
          path: { name: name.peek().trim() },
          body: { from_uid: from.peek(), description: description.peek().trim() },
          timeout_ms: 30_000,
        });
        return strings.made(kept.name);
      }}
      onClose={onClose}
    >
      {online.length === 0 ? (
        <p>{strings.noServos}</p>
      ) : (
        <Choice
          label={strings.from}
          at={from}
          testid="create-from"
          options={online.map(one => ({ key: one.uid, label: `${nameOf(one)}, ${one.model}` }))}
        />
      )}
      <ProfileName at={name} names={names} testid="profile-name" />
      <TextField label={strings.description} at={description} longest={1000} testid="profile-description" />
    </Confirm>
  );
}

export function ImportDialog({ names, onClose }: Props) {
  const file = useSignal<File | null>(null);
  const name = useSignal("");
  const lines = useSignal<readonly LineVerdict[]>([]);
  const act = async () => {
    const chosen = file.peek();
    const type = chosen === null ? null : typeOfFile(chosen.name);
    if (chosen === null || type === null) return "";
    lines.value = [];
    try {
      const imported = await callApi("PUT", "/profiles/{name}/file", {
        path: { name: name.peek().trim() },
        file: { text: await chosen.text(), type },
      });
      return strings.imported(imported.profile?.name ?? name.peek(), imported.lines.length);
    } catch (error) {
      const found = problemOf(error).facts.lines;
      if (Array.isArray(found)) lines.value = found as LineVerdict[];
      throw error;
    }
  };
  const known = file.value !== null && typeOfFile(file.value.name) !== null;
  return (
    <Confirm
      title={strings.importTitle}
      subtitle={strings.importLead}
      verb={strings.importConfirm}
      ready={known && nameOk(name.value)}
      testid="import-dialog"
      actId="import-confirm"
      act={act}
      onClose={onClose}
    >
      <div class="r-file">
        <FilePick
          label={strings.file}
          accept=".toml,.json"
          testid="import-file"
          onFile={chosen => {
            file.value = chosen;
            lines.value = [];
            name.value = nameFromFile(chosen.name);
          }}
        />
        <span class="mono">{file.value?.name}</span>
      </div>
      <ProfileName at={name} names={names} testid="import-name" />
      {lines.value.length > 0 && (
        <DataTable
          small
          label={strings.lineHead.verdict}
          rows={lines.value}
          id={one => lines.value.indexOf(one)}
          data={one => ({ verdict: one.verdict })}
          columns={[
            {
              key: "line",
              head: strings.lineHead.line,
              right: true,
              look: () => "dim",
              cell: one => strings.line(one.line),
            },
            {
              key: "key",
              head: strings.lineHead.key,
              cell: one => (
                <>
                  {rowLabelOf(one.key)} <small class="second">{valueText(one.key, one.value)}</small>
                </>
              ),
            },
            {
              key: "verdict",
              head: strings.lineHead.verdict,
              cell: one => (
                <>
                  <span class={one.verdict === "ok" ? "k-ok" : "strong k-failure"}>
                    {strings.verdict[one.verdict]}
                  </span>{" "}
                  {one.verdict !== "ok" && (
                    <small class="second">{noteText(one.text, one.code, one.params)}</small>
                  )}
                </>
              ),
            },
          ]}
        />
      )}
    </Confirm>
  );
}
