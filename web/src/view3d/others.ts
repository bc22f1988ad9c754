/** Whether the near view also shows the other servos; stored in this browser. */
import { signal } from "@preact/signals";

const KEY = "hornbill.view-all";

function kept(): boolean {
  try {
    return localStorage.getItem(KEY) === "true";
  } catch {
    return false;
  }
}

export const showsAll = signal(kept());

export function toggleAll(): void {
  showsAll.value = !showsAll.peek();
  try {
    localStorage.setItem(KEY, String(showsAll.peek()));
  } catch {
    // Storage is not available; the choice lasts until the page is reloaded.
  }
}
