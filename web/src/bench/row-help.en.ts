/** Shape of the help for rows. Empty in English: the server's tables have it. */

type Sentences = Readonly<Record<string, string>>;

/** By key: help for rows and groups, and the maker's advice on a row. */
export const words: Readonly<Record<"rows" | "groups" | "advice", Sentences>> = {
  rows: {},
  groups: {},
  advice: {},
};
