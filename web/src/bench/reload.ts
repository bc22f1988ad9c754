/** Reloads triggered by the page, for example to change the language. */

let reloading = false;

/** Reload the page, optionally at another address. State of the tab is restored. */
export function reload(address = location.href): void {
  reloading = true;
  if (address === location.href) location.reload();
  else location.replace(address);
}

/** Warn before the page is left while `unsent` is true, except for its own reload. */
export function warnBeforeLeaving(unsent: () => boolean): void {
  addEventListener("beforeunload", event => {
    if (!reloading && unsent()) event.preventDefault();
  });
}
