/** What a tab keeps by itself over a reload: sessionStorage, where the browser allows it. */

/** What was kept under this name; null when there is nothing, or nothing that can be read. */
export function readTab(name: string): unknown {
  try {
    return JSON.parse(sessionStorage.getItem(name) ?? "null");
  } catch {
    return null;
  }
}

/** Keeps it as long as the tab lives. Without storage it is lost at a reload. */
export function writeTab(name: string, value: unknown): void {
  try {
    sessionStorage.setItem(name, JSON.stringify(value));
  } catch {
    // Forbidden, or full.
  }
}
