/** Wiggle in a row, on a phone. Reasons against it are shown when it is pressed. */

import { stopped } from "../bench/bench";
import { type KnownServo, nameOf } from "../bench/fleet";
import { commanderOf, observing } from "../bench/role";
import { wiggle, wiggled, wiggling } from "../bench/wiggle";
import { actionWords } from "../change/words";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";

export function RowWiggle({ one }: { one: KnownServo }) {
  const last = wiggled.value?.uid === one.uid ? wiggled.value : null;
  if (observing.value) return <span role="cell" class="c-wiggle" />;
  return (
    <span role="cell" class="c-wiggle">
      <button
        type="button"
        class="button"
        aria-label={`${actionWords.shortly}: ${nameOf(one)}`}
        aria-disabled={commanderOf(one) !== undefined || !one.online || stopped.value || wiggling.value}
        data-testid={`wiggle-${one.uid}`}
        onClick={() => void wiggle(one.uid)}
      >
        {wiggling.value && last ? <Spinner size={18} /> : <Icon name="wiggle" />}
        {actionWords.shortly}
      </button>
      <span role="alert">
        {last?.phase === "refused" && (
          <button
            type="button"
            class="row-says"
            data-testid={`wiggle-says-${one.uid}`}
            title={actionWords.dismiss}
            onClick={() => {
              wiggled.value = null;
            }}
          >
            <Glyph kind="warning" size={14} /> {actionWords.notWiggled(last.why)}
          </button>
        )}
      </span>
    </span>
  );
}
