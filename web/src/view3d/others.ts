/** Whether the near view shows the other servos, too: a choice of this browser. */
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
    // Not kept then; the choice stands until the page is loaded again.
  }
}
