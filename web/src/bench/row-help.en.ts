/** The shape of what explains the server's rows; in English the server's own tables do. */

type Sentences = Readonly<Record<string, string>>;

/** By key, help for rows and groups of them, and what the maker advises on a row. */
export const words: Readonly<Record<"rows" | "groups" | "advice", Sentences>> = {
  rows: {},
  groups: {},
  advice: {},
};
