/** The two buttons on a 3D frame: how well it is drawn, and the camera back to where it started. */

import { view as words } from "../text/topics";
import { nextQuality, quality, qualityWish } from "./quality";

export function ViewTools({ onReset }: { onReset?: () => void }) {
  const drawn = quality.value;
  if (drawn === null) return null;
  const wish = qualityWish.value;
  return (
    <span class="view-tools">
      {onReset && (
        <button type="button" class="chip" data-testid="view-reset" onClick={onReset}>
          {words.reset}
        </button>
      )}
      <button
        type="button"
        class="chip"
        data-testid="view-quality"
        title={words.qualityHint}
        onClick={nextQuality}
      >
        {wish === "auto" ? words.qualityAuto[drawn] : words.qualities[wish]}
      </button>
    </span>
  );
}
