/** A cell of the matrix: the value of a row on a servo, its deviation from the others, and its editor. */
import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import type { Row } from "../api/types";
import { nameOf, servo } from "../bench/fleet";
import { full, NONE } from "../bench/format";
import { sheetOf } from "../bench/parameters";
import { observing } from "../bench/role";
import type { spanOf } from "../bench/row-state";
import { Marker } from "../change/marker";
import { NumberBox } from "../change/number-box";
import { rowView } from "../change/row-view";
import { stageValue } from "../change/stage";
import { Choice, cell } from "../kit/field";
import type { Outlier } from "./state";
import { optionsOf } from "./state";
import { matrix as strings } from "./words";

interface Props {
  uid: string;
  row: Row;
  odd: Outlier | undefined;
}

export function MatrixCell({ uid, row, odd }: Props) {
  const cell = useRef<HTMLTableCellElement>(null);
  const editing = useSignal(false);
  const sheet = sheetOf(uid);
  const { reading, draft, outcome, one, view, span } = rowView(sheet, row);
  const has = sheet.keys.value?.includes(row.key) ?? false;
  const held = reading?.raw === null ? undefined : reading?.value;
  const able =
    has &&
    !observing.value &&
    !row.expert &&
    sheet.busy.value === null &&
    held !== undefined &&
    held !== null &&
    one?.online === true;
  const open = editing.value && able;
  // Synchronously, so that text typed right after Enter goes into the box.
  useLayoutEffect(() => {
    if (open) cell.current?.querySelector<HTMLElement>("input, select")?.focus();
  }, [open]);

  const verdict = draft?.verdict;
  const wrong = verdict && !verdict.ok ? verdict : null;
  const shown = wrong ? (draft?.text ?? "") : full(verdict?.ok ? verdict.value : held, span);
  const state = !has ? "absent" : view.state;
  const failed = outcome?.kind === "failed" ? `${outcome.what} ${outcome.rest}` : "";
  const notes = [
    has ? "" : strings.absent,
    wrong ? `${wrong.what} ${wrong.remedy}` : failed,
    state === "staged" ? strings.staged(full(held, span)) : view.words,
    odd?.kind === "outlier" ? strings.outlier(full(odd.usual, { ...span, unit: odd.unit })) : "",
    odd?.kind === "apart" ? strings.apart : "",
    row.expert ? strings.locked : "",
  ].filter(Boolean);
  const begin = () => {
    if (able) editing.value = true;
  };
  const end = () => {
    editing.value = false;
    cell.current?.focus();
  };
  const onKeyDown = (event: KeyboardEvent) => {
    if (!open) {
      if (event.key !== "Enter" && event.key !== "F2") return;
      event.preventDefault();
      begin();
      return;
    }
    if (event.key === "Enter" || event.key === "Escape") {
      event.preventDefault();
      end();
    }
  };
  return (
    <td
      ref={cell}
      data-stop={open ? undefined : ""}
      tabIndex={-1}
      data-state={state}
      data-odd={odd?.kind}
      data-testid={`cell-${uid}-${row.key}`}
      class={able ? "able" : ""}
      title={notes.join(". ")}
      {...(able ? {} : { "aria-disabled": true })}
      aria-label={open ? undefined : strings.cell(row.label, nameOf(one), shown, notes.join(". "))}
      onClick={begin}
      onKeyDown={onKeyDown}
    >
      {open ? (
        <Editor
          {...{ uid, row, span, draft, held }}
          onDone={() => {
            editing.value = false;
          }}
        />
      ) : (
        <span class="m-value">
          <span class="m-mark">{has && <Marker state={view.state} />}</span>
          <span class={draft ? "strong" : ""}>{has ? shown : NONE}</span>
          {odd?.kind === "outlier" && <span class="m-odd">≠ {strings.outlierWord}</span>}
          {odd?.kind === "apart" && <span class="m-apart">≠</span>}
          {wrong && <small class="k-failure">{wrong.what}</small>}
          {failed !== "" && <small class="k-failure">{outcome?.kind === "failed" && outcome.what}</small>}
        </span>
      )}
    </td>
  );
}

interface EditorProps {
  uid: string;
  row: Row;
  span: ReturnType<typeof spanOf>;
  draft: ReturnType<ReturnType<typeof sheetOf>["drafts"]["get"]>;
  held: boolean | number | string;
  onDone: () => void;
}

function Editor({ uid, row, span, draft, held, onDone }: EditorProps) {
  const sheet = sheetOf(uid);
  const label = strings.cell(row.label, nameOf(servo(uid)), full(held, span), "");
  if (row.kind === "number") {
    return (
      <NumberBox
        id={`box-${uid}-${row.key}`}
        row={`${uid}-${row.key}`}
        label={label}
        span={span}
        held={typeof held === "number" ? held : null}
        draft={draft}
        locked={false}
        describedBy=""
        onDraft={next => {
          sheet.setOutcomes([[row.key, null]]);
          sheet.drafts.put(row.key, next);
        }}
        onCommit={() => sheet.drafts.commit(row.key, sheet.held(row.key))}
        onRevert={() => sheet.drafts.revert(row.key)}
        onBeginning={() => undefined}
        onLeave={onDone}
      />
    );
  }
  const opts = draft?.verdict.ok ? draft.verdict.value : held;
  return (
    <span onFocusOut={onDone}>
      <Choice
        label={label}
        bare
        testid={`input-${uid}-${row.key}`}
        at={cell(String(opts), key => {
          const value = row.kind === "switch" ? key === "true" : key;
          stageValue(sheet, row.key, { text: key, verdict: { ok: true, value } });
        })}
        options={optionsOf(row)}
      />
    </span>
  );
}
