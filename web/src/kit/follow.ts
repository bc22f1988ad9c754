/** Links inside the page. */
import { go } from "../bench/route";

/** Follow a link inside the page, unless it is to open elsewhere. */
export function follow(event: MouseEvent, path: string): void {
  if (event.button !== 0 || event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  go(path);
}
