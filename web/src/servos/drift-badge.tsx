/**
 * Badges in a servo's row: another tool changed its ROM, or a restart lost RAM values. Each links to the difference.
 */
import { pathOf } from "../bench/route";
import { openDrift } from "../change/requests";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { text } from "../text";

export function DriftBadge({ uid, name }: { uid: string; name: string }) {
  return (
    <button
      type="button"
      class="drift-badge"
      data-testid={`drift-${uid}`}
      aria-label={`${name}: ${text.servos.changedOutside}`}
      onClick={() => {
        openDrift(uid);
      }}
    >
      <Glyph kind="warning" size={14} />
      <span>{text.servos.changedOutside}</span>
    </button>
  );
}

/** A restart lost RAM values: links to where they can be staged again. */
export function LostBadge({ uid, name, n }: { uid: string; name: string; n: number }) {
  const path = pathOf("parameters", uid);
  return (
    <a
      class="drift-badge lost-badge"
      data-testid={`lost-${uid}`}
      aria-label={`${name}: ${text.servos.ramLost(n)}`}
      href={path}
      onClick={event => follow(event, path)}
    >
      <Glyph kind="warning" size={14} />
      <span>{text.servos.ramLost(n)}</span>
    </a>
  );
}
