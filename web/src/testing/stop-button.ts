/** A Stop button with a place on the screen, for tests: without one motion does not start. */
import { type Edges, watchStop } from "../bench/stop-sight";

/** Add a Stop button to the document, visible unless `box` says otherwise. Returns a function that removes it. */
export function stopButton(box: Edges = { left: 840, top: 0, right: 1024, bottom: 64 }): () => void {
  const button = document.createElement("button");
  button.getBoundingClientRect = () =>
    new DOMRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  document.body.append(button);
  const forget = watchStop(button);
  return () => {
    forget();
    button.remove();
  };
}
