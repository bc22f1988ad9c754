/** Text of a servo's condition, shared by its row and its head: headline, output, line, and a link to the remedy. */
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

/** Full text, for a tooltip where a line is truncated. */
export function wholeCondition(of: Condition): string {
  return [of.headline, of.doing, of.line].filter(Boolean).join(". ");
}

/** Snapshots: the remedy for lost saved values. */
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
