/** Names of who did something, in the language of the page. */

/** A stored name of who did something, as people read it: a page by its number in their language, others as they stand. */
export function readable(name: string, page: (n: string) => string): string {
  return name.replace(/(^| · )Page (\d+)$/, (_, before: string, n: string) => before + page(n));
}
