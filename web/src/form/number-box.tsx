/** Owns the box for a number: typed text is staged as it is typed, Enter and leaving make it tidy. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Draft } from "../state/draft";
import { decimalsOf, MINUS, number } from "./format";
import { check, nearest, parseNumber, type Span, unfinished } from "./number";

interface Props {
  id: string;
  row: string;
  span: Span;
  held: number | null;
  draft: Draft | undefined;
  locked: boolean;
  describedBy: string;
  onDraft: (draft: Draft) => void;
  onCommit: () => void;
  /** Told whether the text is still being begun, when no error should be shown yet. */
  onBeginning: (beginning: boolean) => void;
}

export function NumberBox({
  id,
  row,
  span,
  held,
  draft,
  locked,
  describedBy,
  onDraft,
  onCommit,
  onBeginning,
}: Props) {
  const focused = useSignal(false);
  const shown = draft ? draft.text : held === null ? "" : number(held, decimalsOf(span.perUnit));
  const wrong = draft !== undefined && !draft.verdict.ok;

  // The range may come, or change, after the text: judge it anew.
  // Judged anew when the range changes, not when the draft does.
  useEffect(() => {
    if (draft) onDraft({ text: draft.text, verdict: check(draft.text, span) });
  }, [span.minimum, span.maximum, span.perUnit]);

  const put = (typed: string) => onDraft({ text: typed, verdict: check(typed, span) });
  const commit = () => {
    onBeginning(false);
    if (draft?.verdict.ok && typeof draft.verdict.value === "number") {
      const tidy = number(draft.verdict.value, decimalsOf(span.perUnit));
      if (tidy !== draft.text) put(tidy);
    }
    onCommit();
  };
  const step = (event: KeyboardEvent) => {
    const way = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    if (way === 0) return;
    event.preventDefault();
    const from = (draft ? parseNumber(draft.text) : held) ?? held ?? 0;
    const size = event.shiftKey ? 10 : event.altKey ? Math.max(0.1, 1 / span.perUnit) : 1;
    put(number(nearest(from + way * size, span), decimalsOf(span.perUnit)));
  };

  return (
    <span class="box" data-focused={focused.value}>
      <input
        id={id}
        type="text"
        inputMode="decimal"
        autocomplete="off"
        data-testid={`input-${row}`}
        value={shown}
        disabled={locked}
        aria-invalid={wrong}
        aria-describedby={describedBy}
        onFocus={event => {
          focused.value = true;
          event.currentTarget.select();
        }}
        onInput={event => {
          const typed = event.currentTarget.value.replace("-", MINUS);
          onBeginning(unfinished(typed));
          put(typed);
        }}
        onBlur={() => {
          focused.value = false;
          commit();
        }}
        onKeyDown={event => {
          if (event.key === "Enter") commit();
          else step(event);
        }}
      />
      <span class="unit" aria-hidden="true">
        {span.unit}
      </span>
    </span>
  );
}
