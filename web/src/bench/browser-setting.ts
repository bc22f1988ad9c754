/** Settings stored in the browser: a signal backed by localStorage. */
import { type Signal, signal } from "@preact/signals";

/** `read` converts the stored value; null for none. Without storage it lasts until the page is left. */
export function browserSetting<T>(key: string, read: (found: unknown) => T): Signal<T> {
  const value = signal(read(found(key)));
  let first = true;
  value.subscribe(next => {
    if (!first) keep(key, next);
    first = false;
  });
  return value;
}

function found(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "null");
  } catch {
    return null;
  }
}

function keep(key: string, value: unknown): void {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // Blocked in private windows, or the disk is full.
  }
}
