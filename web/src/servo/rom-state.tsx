/** ROM state in the head of a servo: the number and names of unsaved values. */

import type { ComponentChildren } from "preact";
import { catalog } from "../bench/catalog";
import type { KnownServo } from "../bench/fleet";
import { romKnown } from "../bench/parameters";
import { openDrift } from "../change/requests";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { text } from "../text";
import { servoWords } from "./words";

export function RomState({ one }: { one: KnownServo }) {
  const strings = text.servos;
  const labels = (keys: readonly string[]) =>
    keys.map(key => catalog.value?.rows.get(key)?.label ?? key).join(text.comma);
  const drift = one.drift ?? [];
  const lost = one.lost ?? [];
  if (drift.length > 0)
    return (
      <State glyph={<Glyph kind="warning" />} words={strings.changedOutside}>
        <button
          type="button"
          class="link small"
          onClick={() => {
            openDrift(one.uid);
          }}
        >
          {strings.showChanged}
        </button>
      </State>
    );
  if (lost.length > 0)
    return (
      <State
        glyph={<Glyph kind="warning" />}
        words={strings.ramLost(lost.length)}
        line={labels(lost.map(value => value.key))}
      />
    );
  if (one.unsaved.length > 0)
    return (
      <State
        glyph={<Icon name="half" size={16} />}
        words={strings.ramOnly(one.unsaved.length)}
        line={labels(one.unsaved)}
        intent
      />
    );
  return romKnown(one) ? (
    <State glyph={<Icon name="tick" size={16} />} words={servoWords.head.saved} />
  ) : (
    <State glyph={<Icon name="none" size={16} />} words={servoWords.head.notKnown} />
  );
}

interface StateProps {
  glyph: ComponentChildren;
  words: string;
  line?: string;
  intent?: boolean;
  children?: ComponentChildren;
}

function State({ glyph, words, line, intent = false, children }: StateProps) {
  return (
    <div class="rom-state" data-testid="rom-state">
      <span class={intent ? "k-intent" : "second"}>{glyph}</span>
      <span>
        <span class={intent ? "k-intent" : ""}>{words}</span>
        {line && (
          <small class="second" title={line}>
            {line}
          </small>
        )}
        {children}
      </span>
    </div>
  );
}
