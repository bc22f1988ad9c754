/** What the window is: narrow like a tablet, and whether a finger may be what points. */
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

/** A phone's width, as style/narrow.css has it: Stop is as wide as the window. */
export const phone = follow("(max-width: 767px)");

/** Touch density, as the style sheets have it. */
export const touch = follow("(any-pointer: coarse), (max-width: 1024px)");

/** Less motion is wished for. */
export const calm = follow("(prefers-reduced-motion: reduce)");
