/** Message under a row: what is wrong, the remedy, and a button for it. */
import type { Row } from "../api/types";
import type { Draft } from "../bench/draft";
import { full } from "../bench/format";
import type { Outcome } from "../bench/parameters";
import type { RowView, spanOf } from "../bench/row-state";
import { text } from "../text";

interface Props {
  row: Row;
  span: ReturnType<typeof spanOf>;
  draft: Draft | undefined;
  outcome: Outcome | undefined;
  view: RowView;
  onUse: (value: number) => void;
  onRetry: () => void;
}

export function Message({ row, span, draft, outcome, view, onUse, onRetry }: Props) {
  const verdict = draft?.verdict;
  if (verdict && !verdict.ok) {
    return (
      <Line row={row} loud={verdict.what} rest={`${verdict.remedy} ${text.rows.notStaged}`}>
        {(verdict.readings ?? (verdict.nearest === null ? [] : [verdict.nearest])).map(value => (
          <button
            key={value}
            type="button"
            class="link"
            data-testid={`use-${row.key}`}
            onClick={() => onUse(value)}
          >
            {text.rows.use(full(value, span))}
          </button>
        ))}
      </Line>
    );
  }
  if (view.state === "failed" && outcome?.kind === "failed") {
    return (
      <Line row={row} loud={outcome.what} rest={outcome.rest}>
        <button type="button" class="link" data-testid={`retry-${row.key}`} onClick={onRetry}>
          {text.rows.again}
        </button>
      </Line>
    );
  }
  return null;
}

interface LineProps {
  row: Row;
  loud: string;
  rest: string;
  children?: preact.ComponentChildren;
}

function Line({ row, loud, rest, children }: LineProps) {
  return (
    <div role="cell" class="p-message">
      <p id={`message-${row.key}`} data-testid={`message-${row.key}`} role="alert">
        <b>{loud}</b> {rest} {children}
      </p>
    </div>
  );
}
