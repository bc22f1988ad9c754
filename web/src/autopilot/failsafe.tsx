/** What a servo does when commands stop, and the gap that confirmed it: a card of its Overview. */
import type { Failsafe } from "../api/autopilot-types";
import { callApi } from "../api/client";
import type { KnownServo } from "../bench/fleet";
import { clock, number, withUnit } from "../bench/format";
import { sheetOf } from "../bench/parameters";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { useResource } from "../kit/resource";
import { autopilotWords as words } from "./words";

export function FailsafeFacts({ one }: { one: KnownServo }) {
  const sheet = sheetOf(one.uid);
  const set = (["timeout_action", "timeout_time"] as const)
    .map(key => sheet.reading(key).value?.ram ?? "")
    .join(" ");
  // A gap begins when commands end, and is measured when they begin again.
  const commanded = (one.commanded_by ?? []).length > 0;
  const found = useResource(() => callApi("GET", "/servos/{uid}/failsafe", { path: { uid: one.uid } }), {
    again: `${set} ${commanded} ${one.state} ${one.unsaved.length}`,
    of: one.uid,
  });
  const card = found.value.value;
  if (found.problem.value !== null)
    return (
      <p class="small" role="alert">
        <Glyph kind="failure" size={14} /> {found.problem.value}
      </p>
    );
  if (card === null) return null;
  return (
    <>
      <div class="o-fact">
        <span class="o-glyph">
          {card.action === null ? (
            <Glyph kind="notice" />
          ) : (
            <Icon name={card.action === "hold" ? "lock" : "none"} size={16} />
          )}
        </span>
        <p>
          {actionText(card)}
          <small class="second">
            {card.action === null ? words.unknownLine : words.actionLine[card.action]}
          </small>
        </p>
      </div>
      <Gap card={card} />
    </>
  );
}

function Gap({ card }: { card: Failsafe }) {
  const gap = card.confirmed;
  if (card.action === null) return null;
  if (gap === null) return <p class="second small">{words.noGap}</p>;
  const line =
    gap.gap_s === null
      ? words.gapNow(gap.node_id, clock(gap.at))
      : words.gap(gap.node_id, withUnit(number(gap.gap_s, 2), "s"), clock(gap.at));
  return (
    <div class="o-fact" data-testid="failsafe-gap">
      <span class="o-glyph">
        <Glyph kind="ok" />
      </span>
      <p>
        {words.confirmed}
        <small class="second">
          {line} {gap.torque_pct !== null && words.torque(withUnit(number(gap.torque_pct, 0), "%"))}
        </small>
      </p>
    </div>
  );
}

function actionText({ action, after_s }: Failsafe): string {
  if (action === null) return words.unknown;
  return action === "hold" ? words.action.hold : words.action[action](withUnit(number(after_s ?? 0, 1), "s"));
}
