/** The third step: choice of a profile, and its values. */
import { useEffect } from "preact/hooks";
import type { Profile } from "../api/config-types";
import { servo } from "../bench/fleet";
import { date } from "../bench/format";
import { pathOf } from "../bench/route";
import { ProfileValues } from "../change/value-table";
import { Button } from "../kit/button";
import { follow } from "../kit/follow";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { changeDraft, draft, wanted } from "./draft";
import { Actions, StepQuestion } from "./parts";
import { profiles } from "./state";
import { commission as words } from "./words";

const strings = words.profile;

export function ProfileStep() {
  useEffect(() => {
    void profiles.load();
  }, []);
  const list = profiles.value.value;
  const chosen = draft.value.profile;
  useEffect(() => {
    if (list && chosen !== null && !list.some(one => one.name === chosen)) changeDraft({ profile: null });
  }, [list, chosen]);
  const records = pathOf("records", null, "profiles");
  return (
    <>
      <StepQuestion title={strings.title}>
        <p>{strings.lead}</p>
      </StepQuestion>
      <Scroll label={strings.title} testid="profile-step">
        {profiles.problem.value !== null && <Note band>{words.failed(profiles.problem.value)}</Note>}
        <div role="radiogroup" aria-label={strings.choose}>
          <Choice
            name={strings.none}
            line={strings.noneLine}
            on={chosen === null}
            onChoose={() => changeDraft({ profile: null, confirm: [] })}
          />
          {(list ?? []).map(one => (
            <div key={one.name}>
              <Choice
                name={one.name}
                line={[one.description, facts(one)].filter(Boolean).join(" · ")}
                on={chosen === one.name}
                testid={`profile-${one.name}`}
                onChoose={() => changeDraft({ profile: one.name, confirm: [] })}
              />
              {chosen === one.name && <Sets one={one} />}
            </div>
          ))}
        </div>
        {list !== null && list.length === 0 && (
          <div class="w-empty">
            <p class="strong">{strings.empty}</p>
            <p class="second">{strings.emptyLine}</p>
            <a class="button" href={records} onClick={event => follow(event, records)}>
              {strings.toRecords}
            </a>
          </div>
        )}
      </Scroll>
      <Actions>
        <Button onClick={() => changeDraft({ step: "identify" })}>{words.back}</Button>
        <span class="grow" />
        <Button look="primary" testid="profile-go" onClick={() => changeDraft({ step: "check" })}>
          {strings.go}
        </Button>
      </Actions>
    </>
  );
}

function facts(one: Profile): string {
  const rows = strings.rows(Object.keys(one.values).length);
  return `${one.model == null ? strings.anyModel : strings.made(one.model)}, ${rows}, ${date(one.updated_at)}`;
}

interface ChoiceProps {
  name: string;
  line: string;
  on: boolean;
  onChoose: () => void;
  testid?: string;
}

function Choice({ name, line, on, onChoose, testid }: ChoiceProps) {
  return (
    <label class="c-row pick" data-chosen={on} {...(testid ? { "data-testid": testid } : {})}>
      <input type="radio" name="profile" checked={on} onChange={onChoose} />
      <span class="c-who">
        <span class="serial">{name}</span>
        <span class="dim">{line}</span>
      </span>
    </label>
  );
}

function Sets({ one }: { one: Profile }) {
  const other = wanted(draft.value).flatMap(uid => {
    const model = servo(uid)?.model;
    return one.model != null && model && model !== one.model ? [model] : [];
  });
  return (
    <div class="c-sets">
      {other.length > 0 && (
        <Note kind="warning">{strings.otherModel(other.length, [...new Set(other)].join(", "))}</Note>
      )}
      <ProfileValues one={one} head={strings.head} />
    </div>
  );
}
