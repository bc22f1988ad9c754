/** Whether the Stop button is fully visible and can be hit: motion is on only while it is. */
import { signal } from "@preact/signals";

/** A box like DOMRect. */
export interface Edges {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/** Half a pixel of rounding. */
const SLACK_PX = 0.5;

export function within(inner: Edges, outer: Edges): boolean {
  return (
    inner.left >= outer.left - SLACK_PX &&
    inner.top >= outer.top - SLACK_PX &&
    inner.right <= outer.right + SLACK_PX &&
    inner.bottom <= outer.bottom + SLACK_PX
  );
}

/** The visible part of the page: less than the window under pinch zoom or an on-screen keyboard. */
function seen(): Edges {
  const view = window.visualViewport;
  if (!view) return { left: 0, top: 0, right: innerWidth, bottom: innerHeight };
  const { offsetLeft: left, offsetTop: top } = view;
  return { left, top, right: left + view.width, bottom: top + view.height };
}

let button: HTMLElement | null = null;

/** Measure the button: inside the visible part, its words complete, nothing over it. */
function measure(): boolean {
  if (!button?.isConnected) return false;
  const box = button.getBoundingClientRect();
  if (box.width === 0 || !within(box, seen()) || button.scrollWidth > button.clientWidth) return false;
  const top = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
  return top === null || button.contains(top);
}

/** Updated while the window changes; `stopSeen()` measures now. */
export const stopInSight = signal(true);

export function stopSeen(): boolean {
  stopInSight.value = measure();
  return stopInSight.value;
}

/** Keeps the button at the upper right of the visible part, at its own size, under pinch zoom. */
function follow(): void {
  const view = window.visualViewport;
  if (!view || !button) return;
  const pinched = view.scale > 1.001;
  const right = view.offsetLeft + view.width - document.documentElement.clientWidth;
  button.style.transform = pinched
    ? `translate(${right}px, ${view.offsetTop}px) scale(${1 / view.scale})`
    : "";
}

/** Watch the button from now on; null stops it. */
export function watchStop(element: HTMLElement | null): () => void {
  button = element;
  const look = () => {
    follow();
    stopSeen();
  };
  const observer = new ResizeObserver(look);
  if (element) observer.observe(element);
  const view = window.visualViewport;
  view?.addEventListener("resize", look);
  view?.addEventListener("scroll", look);
  addEventListener("resize", look);
  look();
  return () => {
    observer.disconnect();
    view?.removeEventListener("resize", look);
    view?.removeEventListener("scroll", look);
    removeEventListener("resize", look);
  };
}
