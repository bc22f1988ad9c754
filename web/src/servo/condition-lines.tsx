/** The words of a servo's condition, the same in its row and in its head: headline, output, line, and the way to a remedy. */
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
      <span class="condition-more">
        {of.romLost && <ToSnapshots uid={uid} />}
        {of.doing && <small class="second">{of.doing}</small>}
        {(of.line || !of.doing) && (
          <small class={of.alarming ? "strong k-failure" : "second"}>{of.line || "\u00a0"}</small>
        )}
      </span>
    </span>
  );
}

/** All of it, where a line of it may be cut. */
export function wholeCondition(of: Condition): string {
  return [of.headline, of.doing, of.line].filter(Boolean).join(". ");
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
