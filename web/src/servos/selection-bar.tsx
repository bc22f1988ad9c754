/** The bar of the selected servos: actions on several servos. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { problemText } from "../bench/facts";
import { nameOf, peekServo, servo } from "../bench/fleet";
import { go, pathOf } from "../bench/route";
import { endRound, round, wiggleInTurn, wiggling } from "../bench/wiggle";
import { beginChange, ChangeFlow, underWay } from "../change/flow";
import { restartChange } from "../change/requests";
import { torqueOff } from "../change/torque";
import { actionWords } from "../change/words";
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

/** Address of the matrix with these servos. */
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
  const chosen = selected.value;
  const strings = text.servos.bar;
  const shake = () => {
    if (wiggling.peek() || chosen.length === 0) return;
    refused.value = [];
    done.value = null;
    void wiggleInTurn(chosen);
  };
  useKeys({ w: shake });
  useEffect(() => {
    // The results of another selection are outdated.
    if (!wiggling.peek()) round.value = null;
  }, [chosen]);
  if (chosen.length === 0) return null;
  const busy = underWay(chosen);
  const turn = round.value;
  const at = turn && turn.at < turn.uids.length ? turn.uids[turn.at] : undefined;
  const trouble = [
    ...refused.value,
    ...[...(turn?.refused ?? [])].map(([uid, why]) => strings.notWiggled(nameOf(peekServo(uid)), why)),
  ];
  const status =
    turn && at !== undefined
      ? strings.wiggling(nameOf(servo(at)), turn.at + 1, turn.uids.length)
      : turn && turn.at > turn.refused.size
        ? strings.wiggled(turn.at - turn.refused.size)
        : checking.value
          ? actionWords.checking
          : busy
            ? actionWords.underWay(chosen.length)
            : done.value;
  const restart = async () => {
    if (checking.peek()) return;
    refused.value = [];
    done.value = null;
    round.value = null;
    checking.value = true;
    const flow = new ChangeFlow(restartChange(chosen));
    await beginChange(flow.request, flow);
    refused.value = (flow.parts.peek() ?? []).flatMap(one =>
      one.problem ? [strings.notRestarted(nameOf(peekServo(one.uid)), problemText(one.problem))] : [],
    );
    checking.value = false;
  };
  const online = chosen.filter(uid => servo(uid)?.online === true);
  const turnOff = async () => {
    refused.value = [];
    done.value = null;
    const failures = await Promise.all(
      online.map(async uid => {
        const why = await torqueOff(uid);
        return why === null ? [] : [strings.torqueOffFailed(nameOf(peekServo(uid)), why)];
      }),
    );
    refused.value = failures.flat();
    const well = online.length - refused.value.length;
    if (well > 0) done.value = strings.torqueOffDone(well);
  };
  return (
    <section class="selection-bar" aria-label={strings.label(chosen.length)} data-testid="selection-bar">
      <p class="said" role="status">
        <b>{strings.label(chosen.length)}</b>
        <small class="second says" data-testid="selection-says">
          {(at !== undefined || checking.value) && <Spinner size={13} />} {status}
        </small>
      </p>
      {turn && at !== undefined && turn.at + 1 < turn.uids.length ? (
        <Button look="plain" testid="skip-rest" onClick={endRound}>
          {strings.skipRest}
        </Button>
      ) : (
        <Button look="plain" testid="select-none" onClick={selectNone}>
          {strings.none}
        </Button>
      )}
      <span class="grow" />
      <Button live testid="wiggle-selected" title={actionWords.wiggleHint} onClick={shake}>
        <Icon name="wiggle" /> {actionWords.wiggle} <kbd class="touch-hide">W</kbd>
      </Button>
      <Button live testid="restart-selected" disabled={busy} onClick={() => void restart()}>
        {actionWords.restart}
      </Button>
      <Button live testid="torque-off-selected" disabled={online.length === 0} onClick={() => void turnOff()}>
        {text.params.torqueOff}
      </Button>
      <Button testid="plot-selected" pressed={plotting} onClick={onPlot}>
        {strings.plot}
      </Button>
      <Button testid="edit-together" onClick={() => go(matrixPath(chosen))}>
        {strings.edit}
      </Button>
      <Button
        live
        testid="apply-profile"
        disabled={online.length === 0}
        onClick={() => {
          profile.value = true;
        }}
      >
        {strings.profile}
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
