/** Texts of events and of triggers of recordings, in the page's language, or the server's. */
import type { MarkReason, Params } from "../api/types";
import type { BenchEvent } from "./bench";
import { codes } from "./codes";
import { factsOf } from "./facts";
import { who } from "./holder";

export function eventText(one: Pick<BenchEvent, "code" | "text" | "params">): string {
  return codes.value.happened?.[one.code]?.(factsOf(one.params)) ?? who(one.text);
}

/** `params` is missing in old recordings, and empty for a user's text. */
export function markText(one: { reason: MarkReason; text: string; params?: Params }): string {
  const { params } = one;
  if (params === undefined || Object.keys(params).length === 0) return who(one.text);
  return codes.value.marks?.[one.reason]?.(factsOf(params)) ?? who(one.text);
}
