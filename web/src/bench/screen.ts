/** Properties of the window: narrow, phone, touch. */
import { type Signal, signal } from "@preact/signals";

function follow(query: string): Signal<boolean> {
  const list = matchMedia(query);
  const found = signal(list.matches);
  list.addEventListener("change", event => {
    found.value = event.matches;
  });
  return found;
}

export const narrow = follow("(max-width: 1024px)");

/** Too narrow for all cells of the bar, as in frame/bar.css. */
export const tightBar = follow("(max-width: 1240px)");

/** A phone's width, as in style/narrow.css: Stop is as wide as the window. */
export const phone = follow("(max-width: 767px)");

/** Touch density, as in the style sheets. */
export const touch = follow("(any-pointer: coarse), (max-width: 1024px)");

/** Reduced motion is preferred. */
export const calm = follow("(prefers-reduced-motion: reduce)");
