/** Owns the shape of what the doctor's findings say; in English the server says it. */

type Sentences = Readonly<Record<string, string>>;

/**
 * By the code of a finding: titles of what is well and of what is wrong, and remedies that are always the same.
 * `{node}`, `{servo}` and `{count}` (of nodes) stand for what a finding names.
 */
export const words: Readonly<Record<"well" | "wrong" | "remedy", Sentences>> = {
  well: {},
  wrong: {},
  remedy: {},
};
