/** The ticks under a write that asks back: one for each word the server wants to hear before it does it. */
import type { Signal } from "@preact/signals";
import type { SafetyWord } from "../api/config-types";
import { withTick } from "./safety-words";

interface Props {
  needed: readonly SafetyWord[];
  agreed: Signal<readonly SafetyWord[]>;
  sentences: Record<SafetyWord, string>;
}

export function ConfirmTicks({ needed, agreed, sentences }: Props) {
  return (
    <>
      {needed.map(word => (
        <label key={word} class="tick">
          <input
            type="checkbox"
            checked={agreed.value.includes(word)}
            onChange={event => {
              agreed.value = withTick(agreed.peek(), word, event.currentTarget.checked);
            }}
          />
          {sentences[word]}
        </label>
      ))}
    </>
  );
}
