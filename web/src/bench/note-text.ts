/** Text of a note beside a value in the page's language, or the server's. */
import type { RunVerdict } from "../api/lab-types";
import type { NoteCode, Params } from "../api/types";
import { codes } from "./codes";
import { factsOf } from "./facts";
import { who } from "./holder";

export function noteText(
  note: string,
  code: NoteCode | null | undefined,
  params: Params | undefined,
): string {
  return (code && codes.value.notes?.[code]?.(factsOf(params))) ?? who(note);
}

/** Sentence of a verdict on a run in the page's language, or the server's. */
export function verdictText({ text, code, params }: RunVerdict): string {
  return codes.value.verdicts?.[code]?.(factsOf(params)) ?? text;
}

/** Summary of a job's result. */
export function resultText(result: unknown): string {
  const note = (result ?? {}) as { text?: string; text_code?: NoteCode; text_params?: Params };
  return noteText(note.text ?? "", note.text_code, note.text_params);
}
