/** The buttons on a 3D frame: who is shown, the camera back to where it started, how well it is drawn. */

import { showsAll, toggleAll } from "./others";
import { nextQuality, quality, qualityWish } from "./quality";
import { sceneWords as words } from "./words";

export function ViewTools({ onReset, others = false }: { onReset?: () => void; others?: boolean }) {
  const drawn = quality.value;
  if (drawn === null) return null;
  const wish = qualityWish.value;
  return (
    <span class="view-tools">
      {others && (
        <button
          type="button"
          class="chip"
          data-testid="view-all"
          aria-pressed={showsAll.value}
          title={words.allHint}
          onClick={toggleAll}
        >
          {words.all}
        </button>
      )}
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
