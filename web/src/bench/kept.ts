/** Choices that this browser keeps: a signal whose value is in localStorage as well. */
import { type Signal, signal } from "@preact/signals";

/** `read` makes a value of whatever is found there, null for nothing. Where nothing can be kept it holds until the page is left. */
export function kept<T>(key: string, read: (found: unknown) => T): Signal<T> {
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
    // Private windows may refuse, and a full disk does.
  }
}
