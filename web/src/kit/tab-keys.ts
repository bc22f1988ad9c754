/** Arrow keys of a list of tabs: the next one is focused and chosen. */

const WAY: Readonly<Record<string, number>> = { ArrowRight: 1, ArrowLeft: -1 };

/** Handles a key pressed in an element with the role `tablist`. */
export function tabKeys(event: KeyboardEvent): void {
  const way = WAY[event.key];
  const list = event.currentTarget;
  if (way === undefined || !(list instanceof HTMLElement)) return;
  const all = [...list.querySelectorAll<HTMLElement>("[role=tab]")];
  const next = all[(all.indexOf(document.activeElement as HTMLElement) + way + all.length) % all.length];
  next?.focus();
  next?.click();
}
