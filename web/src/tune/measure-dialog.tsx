/** The dialog of a measurement: what to enter, where the horn moves, why it cannot begin, and the press that moves it. */
import type { ComponentChildren } from "preact";
import { type KnownServo, nameOf } from "../bench/fleet";
import { angleNow } from "../bench/fresh";
import { limitsOf } from "../bench/servo-condition";
import { Confirm } from "../kit/confirm";
import { Dial } from "../kit/dial";
import { Note } from "../kit/note";
import { GateNotes, gateOf } from "../servo/motion-gate";
import { closeDialog } from "./dialogs";
import { testing } from "./state";
import { tune as words } from "./words";

interface Props {
  one: KnownServo;
  /** Start of its test IDs. */
  name: string;
  title: (servo: string) => string;
  /** Its button: while motion is on, and otherwise. */
  verbs: readonly [on: string, enable: string];
  act: () => Promise<void> | undefined;
  /** Why it cannot begin, in words; null if it can. */
  against: string | null;
  /** Where the horn moves, if it can; and the same in words. */
  sweep: { from: number; to: number } | null;
  moves: ComponentChildren;
  /** What it writes, and similar. */
  lines: ComponentChildren;
  /** The entries. */
  children: ComponentChildren;
}

export function MeasureDialog({
  one,
  name,
  title,
  verbs,
  act,
  against,
  sweep,
  moves,
  lines,
  children,
}: Props) {
  const { on, able } = gateOf(one);
  const present = angleNow(one);
  return (
    <Confirm
      title={title(nameOf(one))}
      verb={verbs[on ? 0 : 1]}
      doing={words.step.starting}
      danger
      ready={against === null && (on || able) && !testing.value}
      testid={`${name}-dialog`}
      actId={`${name}-go`}
      act={act}
      onClose={closeDialog}
    >
      {children}
      <div class="what-moves">
        <Dial
          size={112}
          angle={present.value}
          limits={limitsOf(one.uid)}
          stale={present.stale}
          {...(sweep ? { sweep } : {})}
        />
        <div>
          {sweep && moves && <p data-testid={`${name}-moves`}>{moves}</p>}
          <Note kind="warning" testid={`${name}-against`}>
            {against}
          </Note>
          {lines}
          {!on && <p class="second small">{words.step.enables}</p>}
        </div>
      </div>
      <GateNotes one={one} />
    </Confirm>
  );
}
