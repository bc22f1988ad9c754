/** Quality of 3D rendering: the setting, the measured performance, and the result of both. */
import { computed, signal } from "@preact/signals";
import { drawable, type Quality } from "../bench/view-url";

export type QualitySetting = "auto" | Quality;

const KEY = "hornbill.view-quality";

function stored(): QualitySetting {
  try {
    const value = localStorage.getItem(KEY);
    return value === "high" || value === "low" ? value : "auto";
  } catch {
    return "auto";
  }
}

export const qualitySetting = signal<QualitySetting>(stored());

/** Whether high quality was measured as too slow since the page was loaded. */
const slow = signal(false);

/** Present quality of frames; null where 3D cannot be rendered. */
export const quality = computed<Quality | null>(() => {
  const able = drawable();
  if (able === null) return null;
  if (qualitySetting.value !== "auto") return qualitySetting.value;
  return slow.value ? "low" : able;
});

/** The next of auto, high, low. */
export function nextQuality(): void {
  const order: QualitySetting[] = ["auto", "high", "low"];
  qualitySetting.value = order[(order.indexOf(qualitySetting.peek()) + 1) % order.length] ?? "auto";
  try {
    localStorage.setItem(KEY, qualitySetting.peek());
  } catch {
    // Storage is not available; the choice lasts until the page is reloaded.
  }
}

/** Draws per second that still look like motion. */
export const ENOUGH_HZ = 15;
const WINDOW_MS = 3000;
/** Opening takes long and does not reflect rendering speed. */
const SETTLING_MS = 4000;

/** Evaluates windows of draws: true once two in a row were too slow. */
export class DrawRate {
  #began: number;
  #draws = 0;
  #poor = 0;

  constructor(now: number) {
    this.#began = now + SETTLING_MS;
  }

  draw(now: number): boolean {
    if (now < this.#began) return false;
    this.#draws += 1;
    if (now - this.#began < WINDOW_MS) return false;
    const rate = (this.#draws * 1000) / (now - this.#began);
    this.#poor = rate < ENOUGH_HZ ? this.#poor + 1 : 0;
    this.#began = now;
    this.#draws = 0;
    return this.#poor >= 2;
  }
}

/** Measure while a frame is shown in automatic high quality, and switch to low if too slow. Returns a function that ends it. */
export function measure(frame: Window): () => void {
  if (qualitySetting.peek() !== "auto" || quality.peek() !== "high") return () => undefined;
  let rate = new DrawRate(performance.now());
  let over = false;
  const step = () => {
    if (over) return;
    // A hidden tab draws nothing, which does not mean that the computer is slow.
    if (document.hidden) rate = new DrawRate(performance.now());
    else if (rate.draw(performance.now())) {
      slow.value = true;
      return;
    }
    frame.requestAnimationFrame(step);
  };
  frame.requestAnimationFrame(step);
  return () => {
    over = true;
  };
}
