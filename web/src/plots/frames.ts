/** Drawing of canvases: one animation frame for all, each at its own rate, hidden ones never. */
import { refreshCount } from "../bench/clock";

interface Drawn {
  draw: (now: number) => void;
  period: number;
  due: number;
  visible: boolean;
}

/** Half a frame of tolerance keeps a rate that divides the screen's from slipping to the next frame. */
const HALF_FRAME_S = 0.008;

const all = new Map<Element, Drawn>();
let frame = 0;
/** Changes of the page until the last frame, and whether that frame was left to them. */
let refreshes = 0;
let left = false;
let timer: ReturnType<typeof setTimeout> | undefined;

const observer =
  typeof IntersectionObserver === "undefined"
    ? null
    : new IntersectionObserver(entries => {
        for (const entry of entries) {
          const one = all.get(entry.target);
          if (one) one.visible = entry.isIntersecting;
        }
        nextFrame();
      });

/** Call `draw` with the monotonic clock (seconds), at most `hz` times per second, while `element` is visible. */
export function everyFrame(element: Element, hz: number, draw: (now: number) => void): () => void {
  all.set(element, { draw, period: 1 / hz, due: 0, visible: observer === null });
  observer?.observe(element);
  nextFrame();
  return () => {
    observer?.unobserve(element);
    all.delete(element);
  };
}

function nextFrame(): void {
  clearTimeout(timer);
  timer = undefined;
  if (frame === 0) frame = requestAnimationFrame(turn);
}

function turn(millis: number): void {
  frame = 0;
  // The layout of the changed values and a plot in one frame would be a long task on a slow computer.
  left = !left && refreshes !== refreshCount();
  refreshes = refreshCount();
  if (left) {
    nextFrame();
    return;
  }
  const now = millis / 1000;
  let next = Number.POSITIVE_INFINITY;
  for (const one of all.values()) {
    if (!one.visible) continue;
    if (now >= one.due) {
      one.due = now + one.period - HALF_FRAME_S;
      one.draw(now);
    }
    next = Math.min(next, one.due);
  }
  // An animation frame has its price even if nothing is drawn in it, so none is requested before one is due.
  const pause = next - now;
  if (pause <= 2 * HALF_FRAME_S) nextFrame();
  else if (pause < Number.POSITIVE_INFINITY) timer = setTimeout(nextFrame, 1000 * pause);
}
