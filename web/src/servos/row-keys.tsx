/** Keys that move through the rows of the list; renders nothing. */
import { useKeys } from "../kit/use-keys";

/** j, k and the arrows move the focus between rows, x selects the row; Enter follows the link. */
export function RowKeys() {
  const row = () => document.activeElement?.closest<HTMLElement>(".servo-row") ?? null;
  const move = (by: 1 | -1) => {
    const known = [...document.querySelectorAll<HTMLElement>(".servo-row .row-link")];
    const at = known.findIndex(one => row()?.contains(one));
    const next = at < 0 ? known.at(by > 0 ? 0 : -1) : known[at + by];
    next?.focus({ preventScroll: true });
    next?.closest(".servo-row")?.scrollIntoView({ block: "nearest" });
  };
  const on = () => move(1);
  const back = () => move(-1);
  useKeys({
    j: on,
    k: back,
    ArrowDown: on,
    ArrowUp: back,
    x: () => row()?.querySelector<HTMLElement>(".c-tick input")?.click(),
  });
  return null;
}
