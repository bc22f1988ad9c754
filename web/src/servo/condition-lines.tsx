/** The words of a servo's condition, the same in its row and in its head: headline, line, output, and the way to a remedy. */
import type { Condition } from "../bench/condition";
import { pathOf } from "../bench/route";
import { follow } from "../kit/follow";
import { text } from "../text";

export function ConditionLines({ uid, of }: { uid: string; of: Condition }) {
  return (
    <span class="condition">
      <span class={of.kind === "ok" ? "" : of.kind === "offline" ? "strong dim" : "strong"}>
        {of.headline}
      </span>
      <small class={of.alarming ? "strong k-failure" : "second"} title={of.line}>
        {of.line || "\u00a0"}
      </small>
      {of.doing && <small class="second">{of.doing}</small>}
      {of.romLost && <ToSnapshots uid={uid} />}
    </span>
  );
}

/** Where what a servo held is kept: the remedy for saved values that are lost. */
export function ToSnapshots({ uid }: { uid: string }) {
  const path = pathOf("records", null, `snapshots/${uid}`);
  return (
    <a
      class="link remedy small"
      href={path}
      data-testid={`to-snapshots-${uid}`}
      onClick={event => follow(event, path)}
    >
      {text.state.toSnapshots}
    </a>
  );
}
