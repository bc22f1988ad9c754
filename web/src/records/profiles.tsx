/** The profiles: their values, creation from a servo or a file, export, and applying them to servos. */

import { useSignal } from "@preact/signals";
import { API, callApi } from "../api/client";
import type { Profile } from "../api/config-types";
import { date } from "../bench/format";
import { openChange } from "../change/flow";
import { profileChange } from "../change/requests";
import { ProfileValues } from "../change/value-table";
import { changing } from "../change/words";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { Icon } from "../kit/icon";
import { Done, Empty } from "../kit/loaded";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { CreateDialog, ImportDialog } from "./profile-dialogs";
import { records as words } from "./words";

const strings = words.profiles;
const choosing = changing.profiles;

type Open = { what: "create" | "import" } | { what: "remove"; one: Profile };

export function Profiles() {
  const list = useResource(() => callApi("GET", "/profiles"));
  const unfolded = useSignal<string | null>(null);
  const open = useSignal<Open | null>(null);
  const note = useSignal<string | null>(null);
  const found = list.value.value;
  const names = found?.map(one => one.name) ?? [];
  const close = (line: string | null) => {
    open.value = null;
    if (line === null) return;
    note.value = line;
    void list.load();
  };
  const present = open.value;
  return (
    <>
      <div class="list-bar r-tools">
        <p class="second grow">{strings.lead}</p>
        <Button live testid="profile-import" onClick={() => (open.value = { what: "import" })}>
          {strings.import}
        </Button>
        <Button
          live
          look="primary"
          testid="profile-create"
          onClick={() => {
            open.value = { what: "create" };
          }}
        >
          {strings.create}
        </Button>
      </div>
      <Scroll label={words.profilesTab} testid="profiles">
        <Loaded of={list} />
        <Done note={note.value} />
        {found === null && list.problem.value === null && <p class="w-line second">{words.loading}</p>}
        {found?.length === 0 && (
          <Empty title={choosing.empty} guides={["profiles"]}>
            {choosing.emptyLine}
          </Empty>
        )}
        <ul>
          {found?.map(one => (
            <li key={one.name} class="list-line" data-testid={`profile-${one.name}`}>
              <div class="list-head">
                <button
                  type="button"
                  class="list-open"
                  aria-expanded={unfolded.value === one.name}
                  aria-label={strings.open(one.name)}
                  onClick={() => {
                    unfolded.value = unfolded.peek() === one.name ? null : one.name;
                  }}
                >
                  <span class="strong">{one.name}</span>
                  <small>
                    {one.description !== "" && `${one.description} · `}
                    {strings.facts(
                      one.model ?? choosing.anyModel,
                      Object.keys(one.values).length,
                      date(one.updated_at),
                    )}
                  </small>
                </button>
                {(["toml", "json"] as const).map(form => (
                  <a
                    key={form}
                    class="button"
                    href={`${API}/profiles/${encodeURIComponent(one.name)}/file?format=${form}`}
                    download=""
                  >
                    <Icon name="download" size={15} /> {strings[form]}
                  </a>
                ))}
                <Button live onClick={() => (open.value = { what: "remove", one })}>
                  {strings.remove}
                </Button>
                <Button live testid="profile-apply" onClick={() => openChange(profileChange(one))}>
                  {strings.apply}
                </Button>
              </div>
              {unfolded.value === one.name && (
                <div class="r-rows">
                  <ProfileValues one={one} head={strings.head} />
                </div>
              )}
            </li>
          ))}
        </ul>
      </Scroll>
      {present?.what === "create" && <CreateDialog names={names} onClose={close} />}
      {present?.what === "import" && <ImportDialog names={names} onClose={close} />}
      {present?.what === "remove" && <RemoveDialog one={present.one} onClose={close} />}
    </>
  );
}

function RemoveDialog({ one, onClose }: { one: Profile; onClose: (note: string | null) => void }) {
  return (
    <Confirm
      title={strings.removeTitle(one.name)}
      verb={strings.removeConfirm}
      danger
      actId="remove-confirm"
      act={() => callApi("DELETE", "/profiles/{name}", { path: { name: one.name } }).then(() => "")}
      onClose={onClose}
    >
      <p>{strings.removeText}</p>
    </Confirm>
  );
}
