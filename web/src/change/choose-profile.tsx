import { callApi } from "../api/client";
import { go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Dialog, Quit } from "../kit/dialog";
import { Loaded, useResource } from "../kit/resource";
import { text } from "../text";
import { openChange } from "./flow";
import { profileChange } from "./requests";
import { changing } from "./words";
import "./change.css";

const strings = changing.profiles;

export function ApplyProfile({ uids, onClose }: { uids: readonly string[]; onClose: () => void }) {
  const list = useResource(() => callApi("GET", "/profiles"));
  const found = list.value.value;
  return (
    <Dialog
      title={strings.title(uids.length)}
      testid="choose-profile"
      onClose={onClose}
      foot={<Quit onClose={onClose} word={text.cancel} />}
    >
      <Loaded of={list} loading={strings.loading} />
      {found?.length === 0 && (
        <>
          <p class="strong">{strings.empty}</p>
          <p class="second">{strings.emptyLine}</p>
          <p>
            <Button onClick={() => go(pathOf("records", null, "profiles"))}>{strings.toProfiles}</Button>
          </p>
        </>
      )}
      {found !== null && found.length > 0 && (
        <ul class="profile-choice">
          {found.map(one => (
            <li key={one.name}>
              <Button
                testid={`profile-${one.name}`}
                onClick={() => {
                  onClose();
                  openChange(profileChange(one, uids));
                }}
              >
                {one.name}
              </Button>
              <span class="second">
                {strings.facts(one.model ?? strings.anyModel, Object.keys(one.values).length)}
                {one.description !== "" && <small class="dim">{one.description}</small>}
              </span>
            </li>
          ))}
        </ul>
      )}
    </Dialog>
  );
}
