/** The bar of the ticked servos: what can be done to several at once. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ask, problemOf } from "../api/client";
import type { Reading } from "../api/types";
import { problemText } from "../bench/facts";
import { nameOf, peekServo, servo } from "../bench/fleet";
import { sheetOf } from "../bench/parameters";
import { go, pathOf } from "../bench/route";
import { endRound, round, wiggleInTurn, wiggling } from "../bench/wiggle";
import type { Planned } from "../change/restart-dialog";
import { planRestart } from "../change/servo-jobs";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { lazy } from "../kit/lazy";
import { useKeys } from "../kit/use-keys";
import { text } from "../text";
import { selected, selectNone } from "./selection";

const ApplyProfile = lazy<{ uids: readonly string[]; onClose: () => void }>(() =>
  import("../change/choose-profile").then(file => file.ApplyProfile),
);

interface Restarts {
  plans: readonly Planned[];
  leftOut: readonly string[];
}

const RestartDialog = lazy<Restarts & { onClose: () => void }>(() =>
  import("../change/restart-dialog").then(file => file.RestartDialog),
);

/** Where the parameters of these servos stand side by side. */
export function matrixPath(uids: readonly string[]): string {
  return pathOf("matrix", null, "", { uids: uids.join(",") });
}

interface Props {
  plotting: boolean;
  onPlot: () => void;
}

export function SelectionBar({ plotting, onPlot }: Props) {
  const profile = useSignal(false);
  const refused = useSignal<readonly string[]>([]);
  const done = useSignal<string | null>(null);
  const checking = useSignal(false);
  const restarts = useSignal<Restarts | null>(null);
  const chosen = selected.value;
  const said = text.servos.bar;
  const shake = () => {
    if (wiggling.peek() || chosen.length === 0) return;
    refused.value = [];
    done.value = null;
    void wiggleInTurn(chosen);
  };
  useKeys({ w: shake });
  useEffect(() => {
    // A round of another selection is over.
    if (!wiggling.peek()) round.value = null;
  }, [chosen]);
  if (chosen.length === 0) return null;
  const turn = round.value;
  const at = turn && turn.at < turn.uids.length ? turn.uids[turn.at] : undefined;
  const trouble = [
    ...refused.value,
    ...[...(turn?.refused ?? [])].map(([uid, why]) => said.notWiggled(nameOf(peekServo(uid)), why)),
  ];
  const status =
    turn && at !== undefined
      ? said.wiggling(nameOf(servo(at)), turn.at + 1, turn.uids.length)
      : turn && turn.at > turn.refused.size
        ? said.wiggled(turn.at - turn.refused.size)
        : checking.value
          ? text.actions.checking
          : done.value;
  const restart = async () => {
    if (checking.peek()) return;
    refused.value = [];
    done.value = null;
    round.value = null;
    checking.value = true;
    const asked = await Promise.all(chosen.map(planOne));
    const plans = asked.flatMap(one => (typeof one === "string" ? [] : [one]));
    refused.value = asked.filter(one => typeof one === "string");
    checking.value = false;
    if (plans.length > 0) restarts.value = { plans, leftOut: refused.peek() };
  };
  const online = chosen.filter(uid => servo(uid)?.online === true);
  const torqueOff = async () => {
    refused.value = [];
    done.value = null;
    const failures = await Promise.all(online.map(torqueOffOne));
    refused.value = failures.filter(one => one !== null);
    const well = online.length - refused.value.length;
    if (well > 0) done.value = said.torqueOffDone(well);
  };
  return (
    <section class="selection-bar" aria-label={said.label(chosen.length)} data-testid="selection-bar">
      <p class="said" role="status">
        <b>{said.label(chosen.length)}</b>
        <small class="second says" data-testid="selection-says">
          {(at !== undefined || checking.value) && <Spinner size={13} />} {status}
        </small>
      </p>
      {turn && at !== undefined && turn.at + 1 < turn.uids.length ? (
        <Button look="plain" testid="skip-rest" onClick={endRound}>
          {said.skipRest}
        </Button>
      ) : (
        <Button look="plain" testid="select-none" onClick={selectNone}>
          {said.none}
        </Button>
      )}
      <span class="grow" />
      <Button live testid="wiggle-selected" title={text.actions.wiggleHint} onClick={shake}>
        <Icon name="wiggle" /> {text.actions.wiggle} <kbd class="touch-hide">W</kbd>
      </Button>
      <Button live testid="restart-selected" onClick={() => void restart()}>
        {text.actions.restart}
      </Button>
      <Button
        live
        testid="torque-off-selected"
        disabled={online.length === 0}
        onClick={() => void torqueOff()}
      >
        {text.params.torqueOff}
      </Button>
      <Button testid="plot-selected" pressed={plotting} onClick={onPlot}>
        {said.plot}
      </Button>
      <Button testid="edit-together" onClick={() => go(matrixPath(chosen))}>
        {said.edit}
      </Button>
      <Button
        live
        testid="apply-profile"
        disabled={online.length === 0}
        onClick={() => {
          profile.value = true;
        }}
      >
        {said.profile}
      </Button>
      {trouble.length > 0 && (
        <ul class="refusals small" role="alert" data-testid="selection-refusals">
          {trouble.map(line => (
            <li key={line}>
              <Glyph kind="failure" size={13} /> {line}
            </li>
          ))}
        </ul>
      )}
      {restarts.value && (
        <RestartDialog
          {...restarts.value}
          onClose={() => {
            restarts.value = null;
          }}
        />
      )}
      {profile.value && (
        <ApplyProfile
          uids={chosen}
          onClose={() => {
            profile.value = false;
          }}
        />
      )}
    </section>
  );
}

/** Null when torque is off, or the sentence that says why that is not known. */
async function torqueOffOne(uid: string): Promise<string | null> {
  try {
    sheetOf(uid).put(await ask<Reading>("POST", `/servos/${uid}/torque`, { body: { mode: "off" } }));
    return null;
  } catch (error) {
    return text.servos.bar.torqueOffFailed(nameOf(peekServo(uid)), problemText(problemOf(error)));
  }
}

/** What a restart would do, or the sentence that says why it is refused. */
async function planOne(uid: string): Promise<Planned | string> {
  try {
    return { uid, plan: await planRestart(uid) };
  } catch (error) {
    return text.servos.bar.notRestarted(nameOf(peekServo(uid)), problemText(problemOf(error)));
  }
}
