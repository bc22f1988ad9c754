/** Owns the bar of the ticked servos: what can be done to several at once. */
import { useSignal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Reading } from "../api/types";
import { nameOf, peekServo, servo } from "../state/fleet";
import { sheetOf } from "../state/parameters";
import { go } from "../state/route";
import { selected, selectNone } from "../state/selection";
import { text } from "../text";
import { Button } from "../ui/button";
import { Glyph } from "../ui/glyph";
import { lazy } from "../ui/lazy";

const ApplyProfile = lazy<{ uids: readonly string[]; onClose: () => void }>(() =>
  import("./apply-profile").then(file => file.ApplyProfile),
);

/** Where the parameters of these servos stand side by side. */
export function matrixPath(uids: readonly string[]): string {
  return `/servos/matrix?uids=${uids.join(",")}`;
}

interface Props {
  plotting: boolean;
  onPlot: () => void;
}

export function SelectionBar({ plotting, onPlot }: Props) {
  const profile = useSignal(false);
  const refused = useSignal<readonly string[]>([]);
  const done = useSignal<string | null>(null);
  const chosen = selected.value;
  const said = text.servos.bar;
  if (chosen.length === 0) return null;
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
      <p class="strong" role="status">
        {said.label(chosen.length)}
        {done.value !== null && <span class="second plain"> {done.value}</span>}
      </p>
      <Button look="plain" testid="select-none" onClick={selectNone}>
        {said.none}
      </Button>
      <span class="grow" />
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
      <Button
        live
        testid="torque-off-selected"
        disabled={online.length === 0}
        onClick={() => void torqueOff()}
      >
        {text.params.torqueOff}
      </Button>
      {refused.value.length > 0 && (
        <ul class="refusals small" role="alert">
          {refused.value.map(line => (
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

/** Null when torque is off, or the sentence that says why that is not known. */
async function torqueOffOne(uid: string): Promise<string | null> {
  try {
    sheetOf(uid).put(await ask<Reading>("POST", `/servos/${uid}/torque`, { body: { mode: "off" } }));
    return null;
  } catch (error) {
    return text.servos.bar.torqueOffFailed(nameOf(peekServo(uid)), text.problem(problemOf(error)));
  }
}
