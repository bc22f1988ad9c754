/** Drawing of canvases: one animation frame for all, each at its own rate, hidden ones never. */

interface Drawn {
  draw: (now: number) => void;
  period: number;
  due: number;
  visible: boolean;
}

const all = new Map<Element, Drawn>();
let frame = 0;

const observer =
  typeof IntersectionObserver === "undefined"
    ? null
    : new IntersectionObserver(entries => {
        for (const entry of entries) {
          const one = all.get(entry.target);
          if (one) one.visible = entry.isIntersecting;
        }
      });

/** Call `draw` with the monotonic clock (seconds), at most `hz` times per second, while `element` is visible. */
export function everyFrame(element: Element, hz: number, draw: (now: number) => void): () => void {
  all.set(element, { draw, period: 1 / hz, due: 0, visible: observer === null });
  observer?.observe(element);
  if (frame === 0) frame = requestAnimationFrame(turn);
  return () => {
    observer?.unobserve(element);
    all.delete(element);
  };
}

function turn(millis: number): void {
  const now = millis / 1000;
  for (const one of all.values()) {
    if (!one.visible || now < one.due) continue;
    // Half a frame of tolerance keeps a rate that divides the screen's from slipping to the next frame.
    one.due = now + one.period - 0.008;
    one.draw(now);
  }
  frame = all.size === 0 ? 0 : requestAnimationFrame(turn);
}
