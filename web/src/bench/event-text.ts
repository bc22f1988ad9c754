/** What happened, and what a recording was written for, in the page's language; the server's words where it has none. */
import type { MarkReason, Params } from "../api/types";
import type { BenchEvent } from "./bench";
import { codes } from "./codes";
import { factsOf } from "./facts";
import { who } from "./holder";

export function eventText(one: Pick<BenchEvent, "code" | "text" | "params">): string {
  return codes.value.happened?.[one.code]?.(factsOf(one.params)) ?? who(one.text);
}

/** `params` is missing in recordings of older versions, and empty where the text is a user's. */
export function markText(one: { reason: MarkReason; text: string; params?: Params }): string {
  const { params } = one;
  if (params === undefined || Object.keys(params).length === 0) return who(one.text);
  return codes.value.marks?.[one.reason]?.(factsOf(params)) ?? who(one.text);
}
