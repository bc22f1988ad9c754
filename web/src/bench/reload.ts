/** Loading the page again by its own wish, for instance in another language. */

let reloading = false;

/** Loads the page again, at another address if one is given. What this tab keeps comes back by itself. */
export function reload(address = location.href): void {
  reloading = true;
  if (address === location.href) location.reload();
  else location.replace(address);
}

/** Has the browser ask before the page is left while `unsent` says so, unless it merely loads itself again. */
export function askBeforeLeaving(unsent: () => boolean): void {
  addEventListener("beforeunload", event => {
    if (!reloading && unsent()) event.preventDefault();
  });
}
