/** Owns what the server says to programs: taken out of a sentence before people read it. */

/** "METHOD /path", as a sentence of the server names a request. */
const REQUEST = "(?:GET|PUT|POST|PATCH|DELETE) (?:/api/|…/)";

/** In this order: a clause that is for programs goes, what it explains stays. */
const CLAUSES: readonly RegExp[] = [
  /,? or send it again with confirm: \[[^\]]*\]/gi,
  new RegExp(String.raw` \(${REQUEST}[^)]*\)`, "g"),
  / \(parameter [a-z_]+\)/g,
  new RegExp(String.raw`: (?:see )?${REQUEST}.*?(?=\.(?:\s|$)|$)`, "g"),
];

/** What makes a whole sentence one for programs. */
const FOR_PROGRAMS = new RegExp(
  [
    REQUEST,
    "/api/v1",
    String.raw`\bconfirm: `,
    "Content-Type",
    String.raw`\bheader '`,
    String.raw`: true\.$`,
  ].join("|"),
);

/** `detail` without its advice to programs. A text that has nothing else stays as it is: better that than silence. */
export function plain(detail: string): string {
  const shorter = CLAUSES.reduce((text, clause) => text.replace(clause, ""), detail);
  const left = shorter.split(/(?<=[.?!])\s+/).filter(sentence => !FOR_PROGRAMS.test(sentence));
  return left.length > 0 ? left.join(" ") : detail;
}
