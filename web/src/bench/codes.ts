/** Texts by code in the page's language. Empty in English: the server's texts are used. */
import { signal } from "@preact/signals";
import type { Problem } from "../api/client";
import type { RunVerdict } from "../api/lab-types";
import type { Caution, EventCode, MarkReason, NoteCode } from "../api/types";
import { awaitWords, currentLanguage } from "../text/language";
import type { Facts, FactsText } from "./facts";

type ByCode<Code extends string> = Readonly<Partial<Record<Code, FactsText>>>;

export interface Codes {
  happened: ByCode<EventCode>;
  /** Triggers of recordings. */
  marks: ByCode<MarkReason>;
  /** Notes beside values. */
  notes: ByCode<NoteCode>;
  /** Verdicts on runs. */
  verdicts: ByCode<RunVerdict["code"]>;
  /** Cautions before commands. */
  cautions: ByCode<Caution["code"]>;
  /** Causes of problems, also of adapters and buses. */
  causes: ByCode<string>;
  problem: (problem: Problem, facts: Facts) => string;
}

/** Empty until loaded: the first page is shown without them, and rendered again when they arrive. */
export const codes = signal<Partial<Codes>>({});

awaitWords(async () => {
  if (currentLanguage() === "ja") codes.value = (await import("../text/ja/codes")).codes;
});
