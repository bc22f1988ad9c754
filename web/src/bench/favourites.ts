/** Favourite rows, stored in the browser. */
import { computed } from "@preact/signals";
import { browserSetting } from "./browser-setting";

const keys = browserSetting<readonly string[]>("hornbill.favourites", found =>
  Array.isArray(found) ? found.filter(one => typeof one === "string") : [],
);

export const favourites = computed<ReadonlySet<string>>(() => new Set(keys.value));

export function toggleFavourite(key: string): void {
  const before = keys.peek();
  keys.value = before.includes(key) ? before.filter(one => one !== key) : [...before, key];
}
