/** Base path of the page behind a proxy, and the token of the link that opened it. */

/** Base path without a trailing slash; empty unless a proxy adds one. */
export const ROOT =
  document.querySelector<HTMLMetaElement>('meta[name="hornbill-root"]')?.content.replace(/\/$/, "") ?? "";

/** A decoded part of an address; unchanged if it has an invalid escape. */
export function decoded(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

const LINK = /^#token=([^&]+)$/;

/** Removed from the address at once, to keep it out of history, bookmarks and screenshots. */
function takeToken(): string | null {
  const found = LINK.exec(location.hash)?.[1];
  if (found === undefined) return null;
  history.replaceState(null, "", location.pathname + location.search);
  return decoded(found);
}

let token = takeToken();

/** The token of the link. Returned once. */
export function linkToken(): string | null {
  const found = token;
  token = null;
  return found;
}
