/** Buttons of a 3D frame: other servos, reset of the camera, and quality. */

import { showsAll, toggleAll } from "./others";
import { nextQuality, quality, qualitySetting } from "./quality";
import { sceneWords as words } from "./words";

export function ViewTools({ onReset, others = false }: { onReset?: () => void; others?: boolean }) {
  const drawn = quality.value;
  if (drawn === null) return null;
  const setting = qualitySetting.value;
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
        {setting === "auto" ? words.qualityAuto[drawn] : words.qualities[setting]}
      </button>
    </span>
  );
}
