/** Stored names of pages, in the language of the page. */

/** The stored name of a page: a code with its number, the same in every language. */
export function pageName(n: number): string {
  return `page-${n}`;
}

/** A text, with stored names of pages in it replaced by what `page` makes of their numbers. */
export function readable(text: string, page: (n: string) => string): string {
  return text.replace(/(?<![\w-])page-(\d{4})(?![\w-])/g, (_, n: string) => page(n));
}
