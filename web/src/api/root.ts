/** Where this page lives: below which path a proxy shows it, and the token of the link that opened it. */

/** The path everything of hornbill's is below, without a slash at its end: empty unless a proxy adds one. */
export const ROOT =
  document.querySelector<HTMLMetaElement>('meta[name="hornbill-root"]')?.content.replace(/\/$/, "") ?? "";

/** A part of an address in plain text; as it stands where a "%" in it is none of an escape. */
export function decoded(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

const LINK = /^#token=([^&]+)$/;

/** Taken out of the address at once, so that it is in no history, bookmark or picture of the screen. */
function takeToken(): string | null {
  const found = LINK.exec(location.hash)?.[1];
  if (found === undefined) return null;
  history.replaceState(null, "", location.pathname + location.search);
  return decoded(found);
}

let token = takeToken();

/** The token of the link, once. */
export function linkToken(): string | null {
  const found = token;
  token = null;
  return found;
}
