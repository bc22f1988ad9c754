/** Owns the fourth step: what each servo becomes, what moves, and the one press that starts the job. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { SafetyWord } from "../api/config-types";
import { NONE } from "../form/format";
import {
  asking,
  forecasts,
  loadForecasts,
  loadProfiles,
  profiles,
  refused,
  start,
} from "../state/commission";
import { change, count, draft, wanted } from "../state/commission-draft";
import { stopped } from "../state/desk";
import { servo } from "../state/fleet";
import { commission as words } from "../text/topics";
import { Button } from "../ui/button";
import { Glyph } from "../ui/glyph";
import { Spinner } from "../ui/icon";
import { Scroll } from "../ui/scroll";
import { Segments } from "../ui/segments";
import { Actions, Question, Toggle } from "./commission-parts";

const said = words.check;

export function CheckStep() {
  const free = useSignal(false);
  useEffect(() => {
    void loadForecasts();
    if (draft.peek().profile !== null) void loadProfiles();
    refused.value = null;
  }, []);
  const present = draft.value;
  const uids = wanted(present);
  const known = forecasts.value;
  // What is not known is taken to move; a profile may bring soft start or torque with it.
  const moves = present.save && uids.some(uid => known.get(uid)?.moves !== false || present.profile !== null);
  const problem = refused.value;
  const needed = [
    ...present.confirm,
    ...(problem?.confirm && !present.confirm.includes(problem.confirm) ? [problem.confirm] : []),
  ];
  const unmet = problem?.confirm != null && !present.confirm.includes(problem.confirm);
  const agree = (word: SafetyWord, on: boolean) => {
    change({
      confirm: on ? [...present.confirm, word] : present.confirm.filter(one => one !== word),
    });
  };
  return (
    <>
      <Question title={said.title}>
        <p>{said.lead(uids.length)}</p>
      </Question>
      <Scroll label={said.title} testid="check-step">
        {problem && (
          <div class="c-note bad" role="alert" data-testid="start-refused">
            <Glyph kind="failure" />
            <p class="grow">
              <b>{said.refused}</b> {problem.text}
            </p>
            {problem.uid !== null && uids.includes(problem.uid) && problem.confirm === null && (
              <Button onClick={() => toEntry(problem.uid ?? "")} testid="refused-change">
                {said.change}
              </Button>
            )}
          </div>
        )}
        <table class="c-table" aria-label={said.table}>
          <thead>
            <tr>
              <th>{said.head.servo}</th>
              <th class="right">{said.head.id}</th>
              <th class="right">{said.head.node}</th>
              <th>{said.head.name}</th>
              <th>{present.save && said.head.moves}</th>
            </tr>
          </thead>
          <tbody>
            {uids.map(uid => (
              <Row key={uid} uid={uid} />
            ))}
          </tbody>
        </table>
        <p class="w-line second">
          {profileLine(present.profile)}
          {count(present).skipped > 0 && ` · ${said.leftOut(count(present).skipped)}`}
        </p>
        <div class="c-options">
          <Toggle label={said.save} on={present.save} testid="save" onChange={save => change({ save })} />
          <p class="second">{present.save ? said.saveLine : said.noSaveLine}</p>
          {uids.length > 1 && (
            <div class="c-option">
              <span>{said.anomaly}</span>
              <Segments
                label={said.anomaly}
                chosen={present.onAnomaly}
                onChoose={onAnomaly => change({ onAnomaly })}
                options={[
                  { key: "stop", label: said.stop },
                  { key: "continue", label: said.goOn },
                ]}
              />
            </div>
          )}
          {needed.map(word => (
            <Toggle
              key={word}
              label={said.confirm[word]}
              on={present.confirm.includes(word)}
              testid={`confirm-${word}`}
              onChange={on => agree(word, on)}
            />
          ))}
          {moves && (
            <Toggle
              label={said.free}
              on={free.value}
              testid="horn-free"
              onChange={on => {
                free.value = on;
              }}
            />
          )}
        </div>
      </Scroll>
      <Actions>
        <Button onClick={() => change({ step: "profile" })}>{words.back}</Button>
        <span class="grow second">{stopped.value && words.identify.stopped}</span>
        <Button
          look="primary"
          live
          testid="start"
          disabled={asking.value || unmet || stopped.value || (moves && !free.value) || uids.length === 0}
          onClick={() => void start()}
        >
          {asking.value && <Spinner />}
          {said.go(uids.length)}
        </Button>
      </Actions>
    </>
  );
}

function toEntry(uid: string): void {
  const entry = draft.peek().entries[uid];
  if (!entry) return;
  change({
    step: "identify",
    at: uid,
    entries: { ...draft.peek().entries, [uid]: { ...entry, state: "open" } },
  });
}

function profileLine(name: string | null): string {
  if (name === null) return said.noProfile;
  const found = profiles.value?.find(one => one.name === name);
  return said.profile(name, Object.keys(found?.values ?? {}).length);
}

function Row({ uid }: { uid: string }) {
  const entry = draft.value.entries[uid];
  const one = servo(uid);
  const forecast = forecasts.value.get(uid);
  if (!entry) return null;
  const label = entry.label.trim();
  return (
    <tr data-testid={`check-${uid}`}>
      <td>
        <span class="strong c-serial">{one?.serial ?? one?.name ?? uid.slice(0, 8)}</span>
        <small>{one?.model}</small>
      </td>
      <td class="right c-serial">
        <span class="second">{one?.servo_id ?? NONE} → </span>
        <span class="strong k-intent">{entry.servoId}</span>
      </td>
      <td class="right">
        {entry.nodeId.trim() === "" ? (
          <span class="second">{said.same}</span>
        ) : (
          <span class="strong k-intent">{entry.nodeId.trim() === "0" ? said.keeps : entry.nodeId}</span>
        )}
      </td>
      <td>
        {label === "" ? <span class="dim">{said.noName}</span> : <span class="strong k-intent">{label}</span>}
      </td>
      <td>
        {draft.value.save &&
          (forecast === undefined ? (
            <span class="c-working dim">
              <Spinner /> {said.asking}
            </span>
          ) : (
            <span class={forecast.moves === false ? "second" : ""}>{forecast.text}</span>
          ))}
      </td>
    </tr>
  );
}
