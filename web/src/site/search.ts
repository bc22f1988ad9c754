/** Search by serial, label and UID, anywhere in the text and in either case. */

interface Searched {
  uid: string;
  label: string;
  serial: string | null;
}

/** Where the typed text is in `text`; null if it is not, or nothing is typed. */
export function matchOf(text: string, typed: string): { from: number; to: number } | null {
  const word = typed.trim().toLowerCase();
  const from = word === "" ? -1 : text.toLowerCase().indexOf(word);
  return from < 0 ? null : { from, to: from + word.length };
}

/** True if serial, label or UID contains the typed text; also if nothing is typed. */
export function isSearched(one: Searched, typed: string): boolean {
  if (typed.trim() === "") return true;
  return [one.serial, one.label, one.uid].some(text => text !== null && matchOf(text, typed) !== null);
}
