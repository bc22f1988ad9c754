/** Rows of the list under headings that fold: the first part of a label, a model or a state, each with a count. */
import type { ConditionKind } from "../bench/condition";
import { servo } from "../bench/fleet";
import { conditionHere } from "../bench/servo-condition";
import { cell, Tick } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { text } from "../text";
import type { Grouping } from "./grouping";
import { fold, groupOf, inGroups, isFolded, type RowGroup } from "./groups";
import { ServoRow } from "./row";
import { isSelected, select } from "./selection";
import { headings as words } from "./words";

interface Props {
  uids: readonly string[];
  by: Grouping;
}

/** Groups are live: a servo whose state changes moves to another heading. */
export function GroupedRows({ uids, by }: Props) {
  const keyOf = (uid: string) => {
    const one = servo(uid);
    return one ? groupOf(one, conditionHere(one).kind, by) : "";
  };
  return (
    <>
      {inGroups(uids, by, keyOf).map(one => (
        <div key={one.key} role="rowgroup">
          <GroupHead of={one} by={by} />
          {!isFolded(one.key) && one.uids.map(uid => <ServoRow key={uid} uid={uid} />)}
        </div>
      ))}
    </>
  );
}

/** Heading of a group, with its count and a check box for all its servos. A press folds it. */
function GroupHead({ of, by }: { of: RowGroup; by: Grouping }) {
  const name = of.key === "" ? words.rest : by === "state" ? words[of.key as ConditionKind] : of.key;
  const open = !isFolded(of.key);
  const ticked = of.uids.filter(isSelected).length;
  return (
    <div role="row" class="servo-group">
      <span role="cell">
        <Tick
          label={text.servos.select(name)}
          bare
          at={cell(ticked === of.uids.length, on => select(of.uids, on))}
          some={ticked > 0 && ticked < of.uids.length}
          testid={`select-group-${of.key}`}
        />
      </span>
      <span role="rowheader">
        <button
          type="button"
          class="group-fold"
          data-testid={`group-${of.key}`}
          aria-expanded={open}
          onClick={() => fold(of.key, open)}
        >
          <Icon name={open ? "down" : "right"} size={16} />
          {by === "state" && of.key !== "" && <Glyph kind={of.key as ConditionKind} size={14} />}
          <b>{name}</b> <span class="second">{of.uids.length}</span>
        </button>
      </span>
    </div>
  );
}
