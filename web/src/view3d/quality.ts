/** How well 3D is drawn: the wish, what the machine turned out to manage, and what follows from both. */
import { computed, signal } from "@preact/signals";
import { drawable, type Quality } from "../bench/view-url";

export type QualityWish = "auto" | Quality;

const KEY = "hornbill.view-quality";

function kept(): QualityWish {
  try {
    const value = localStorage.getItem(KEY);
    return value === "high" || value === "low" ? value : "auto";
  } catch {
    return "auto";
  }
}

export const qualityWish = signal<QualityWish>(kept());

/** Seen drawing slowly in high quality since the page was loaded. */
const slow = signal(false);

/** How frames are drawn now; null where 3D cannot be drawn at all. */
export const quality = computed<Quality | null>(() => {
  const able = drawable();
  if (able === null) return null;
  if (qualityWish.value !== "auto") return qualityWish.value;
  return slow.value ? "low" : able;
});

/** The next of auto, high, low. */
export function nextQuality(): void {
  const order: QualityWish[] = ["auto", "high", "low"];
  qualityWish.value = order[(order.indexOf(qualityWish.peek()) + 1) % order.length] ?? "auto";
  try {
    localStorage.setItem(KEY, qualityWish.peek());
  } catch {
    // Not kept then; the choice stands until the page is loaded again.
  }
}

/** Draws of a second that still look like motion. */
export const ENOUGH_HZ = 15;
const WINDOW_MS = 3000;
/** Opening takes long and says nothing about drawing. */
const SETTLING_MS = 4000;

/** Judges windows of draws: true once two in a row were too slow. */
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

/** Measures while a frame is shown in high quality by itself; too slow, and all go on in low. The answer ends it. */
export function measure(frame: Window): () => void {
  if (qualityWish.peek() !== "auto" || quality.peek() !== "high") return () => undefined;
  let rate = new DrawRate(performance.now());
  let over = false;
  const step = () => {
    if (over) return;
    // A hidden tab draws nothing; that is no sign of a slow machine.
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
