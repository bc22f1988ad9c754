/** Parameter rows somebody marked as favourites: kept for this browser. */
import { signal } from "@preact/signals";

const KEY = "hornbill.favourites";

function kept(): ReadonlySet<string> {
  try {
    const found: unknown = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    return new Set(Array.isArray(found) ? found.filter(one => typeof one === "string") : []);
  } catch {
    return new Set();
  }
}

export const favourites = signal(kept());

export function toggleFavourite(key: string): void {
  const next = new Set(favourites.peek());
  if (!next.delete(key)) next.add(key);
  favourites.value = next;
  try {
    localStorage.setItem(KEY, JSON.stringify([...next]));
  } catch {
    // Not kept: it holds until the page is left.
  }
}
