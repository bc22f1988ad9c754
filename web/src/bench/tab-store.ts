/** State of a tab over a reload: sessionStorage, if available. */

/** The stored value; null if missing or invalid. */
export function readTab(name: string): unknown {
  try {
    return JSON.parse(sessionStorage.getItem(name) ?? "null");
  } catch {
    return null;
  }
}

/** Store a value for the life of the tab. Without storage it is lost at a reload. */
export function writeTab(name: string, value: unknown): void {
  try {
    sessionStorage.setItem(name, JSON.stringify(value));
  } catch {
    // Storage blocked or full.
  }
}
