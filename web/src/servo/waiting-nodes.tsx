/** Nodes waiting for a node ID, with the parts of the unique ID received. */

import { now } from "../bench/clock";
import { pending } from "../bench/fleet";
import { age } from "../bench/format";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { text } from "../text";

export function Waiting() {
  return (
    <>
      {pending.value.map(one => (
        <div key={one.uid_part} class="node-waiting" data-testid={`waiting-${one.uid_part}`}>
          <Glyph kind="identifying" />
          <span class="strong">{text.servos.waiting}</span>
          <span class="mono dim">{shorten(one.uid_part)}</span>
          <span class="stages small">
            {text.servos.stages.map((word, place) => (
              <span key={word} class={place > one.stage ? "dim" : "second"}>
                {place < one.stage && (
                  <span class="k-ok">
                    <Icon name="tick" size={14} />
                  </span>
                )}
                {place === one.stage && (
                  <span class="k-intent">
                    <Spinner size={14} />
                  </span>
                )}
                {word}
                {place === one.stage && `, ${age(one.age_s + Math.max(0, now.value - one.receivedAt))}`}
              </span>
            ))}
          </span>
          <span class="small dim usual">{text.servos.usually}</span>
        </div>
      ))}
    </>
  );
}

function shorten(part: string): string {
  return part.length > 8 ? `${part.slice(0, 4)}…${part.slice(-4)}` : part;
}
