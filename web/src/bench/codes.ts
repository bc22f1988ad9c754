/** What the server tells by a code, in the page's language. English has no such words: the server says it itself. */
import { signal } from "@preact/signals";
import type { Problem } from "../api/client";
import type { Caution, EventCode, MarkReason, NoteCode } from "../api/types";
import { awaitWords, spoken } from "../text/language";
import type { Facts, Saying } from "./facts";

type ByCode<Code extends string> = Readonly<Partial<Record<Code, Saying>>>;

export interface Codes {
  happened: ByCode<EventCode>;
  /** What a recording was written for. */
  marks: ByCode<MarkReason>;
  /** What is noted beside a value. */
  notes: ByCode<NoteCode>;
  /** What to know before a command. */
  cautions: ByCode<Caution["code"]>;
  /** What exactly went wrong, by the cause of a problem, of an adapter, or of a bus. */
  causes: ByCode<string>;
  problem: (problem: Problem, facts: Facts) => string;
}

/** Empty until they are here: the first page is shown without them, and says these things again when they come. */
export const codes = signal<Partial<Codes>>({});

awaitWords(async () => {
  if (spoken() === "ja") codes.value = (await import("../text/ja/codes")).codes;
});
