/** In a servo's row: somebody else wrote to its ROM: leads to what differs. */
import { openDrift } from "../change/requests";
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
