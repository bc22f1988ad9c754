/** A parameter row: marker, name and state, box, range, RAM, ROM, default, and its message. */
import { useSignal } from "@preact/signals";
import type { Row } from "../api/types";
import type { Draft } from "../bench/draft";
import { favourites, toggleFavourite } from "../bench/favourites";
import { bare, decimalsOf, full, number } from "../bench/format";
import { nearestAllowed } from "../bench/number";
import { outputLine, switchedOff } from "../bench/output";
import type { Sheet } from "../bench/parameters";
import { aboutRow } from "../bench/row-help";
import type { spanOf } from "../bench/row-state";
import { text } from "../text";
import { ChoiceBox, SwitchBox } from "./choice-box";
import { Marker } from "./marker";
import { NumberBox } from "./number-box";
import { Help } from "./row-help";
import { Message } from "./row-message";
import { rowView } from "./row-view";
import { Ruler } from "./ruler";
import { scaleOf } from "./scale";
import { editing as words } from "./words";

interface Props {
  sheet: Sheet;
  row: Row;
  /** Show another row, by the name of its register. */
  onGoTo: (name: string) => void;
  onRetry: () => void;
  /** Expert rows stay locked until unlocked. */
  locked: boolean;
}

/** Register and raw value as tooltip; "?" shows them, too. */
function tooltip(row: Row, reading: { raw: number | null } | undefined): string {
  return `${row.name}, ${words.help.raw} ${reading?.raw ?? words.help.unread}. ${aboutRow(row)}`;
}

const asNumber = (value: unknown) => (typeof value === "number" ? value : null);

export function ParameterRow({ sheet, row, onGoTo, onRetry, locked }: Props) {
  const beginning = useSignal(false);
  const explained = useSignal(false);
  const { reading, draft, outcome, one, unsaved, view, span } = rowView(sheet, row);
  const quiet = beginning.value && (view.state === "invalid" || view.state === "out_of_range");
  const state = quiet ? "staged" : view.state;
  const stage = (next: Draft) => {
    if (outcome) sheet.setOutcomes([[row.key, null]]);
    sheet.drafts.put(row.key, next);
  };
  const commit = () => sheet.drafts.commit(row.key, reading?.value);
  const standard = reading?.default ?? null;
  const current = draft ? (draft.verdict.ok ? draft.verdict.value : undefined) : reading?.value;
  /** Stages the default; a second press stages the RAM value. */
  const toDefault = () => {
    const value = current === standard ? (reading?.value ?? null) : standard;
    if (value === null) return;
    const typed = typeof value === "number" ? bare(value, span) : String(value);
    stage({ text: typed, verdict: { ok: true, value } });
    commit();
  };
  const romDiffers =
    unsaved || (reading?.rom != null && reading.value !== null && reading.rom !== reading.value);
  const noteId = `note-${row.key}`;
  return (
    <div role="row" class="prow" id={`row-${row.key}`} data-testid={`row-${row.key}`} data-state={state}>
      <span class="p-mark" role="presentation">
        <Marker state={state} />
      </span>
      <span role="rowheader" class="p-name">
        <span class="p-title">
          <label for={`box-${row.key}`} title={tooltip(row, reading)}>
            {row.label}
          </label>
          <button
            type="button"
            class="help-button"
            aria-expanded={explained.value}
            aria-controls={`help-${row.key}`}
            aria-label={words.help.open(row.label)}
            title={words.help.open(row.label)}
            data-testid={`help-${row.key}`}
            onClick={() => {
              explained.value = !explained.value;
            }}
          >
            ?
          </button>
          <button
            type="button"
            class="help-button"
            aria-pressed={favourites.value.has(row.key)}
            aria-label={words.favourite(row.label)}
            title={words.favourite(row.label)}
            data-testid={`favourite-${row.key}`}
            onClick={() => toggleFavourite(row.key)}
          >
            {favourites.value.has(row.key) ? "★" : "☆"}
          </button>
        </span>
        <small id={noteId}>
          {row.name}, §{row.section}
          {row.key === "torque_mode" && one?.online && switchedOff(one.output) && (
            <>
              {text.period}
              {outputLine(one.output)}
            </>
          )}
          {(quiet ? "" : view.words) !== "" && (
            <>
              {text.period}
              <span class="words">{view.words.replace(/[.。]$/, "")}</span>
            </>
          )}
          {view.goTo && (
            <>
              {text.period}
              <button type="button" class="link" onClick={() => onGoTo(view.goTo ?? "")}>
                {text.rows.goTo(view.goTo)}
              </button>
            </>
          )}
        </small>
      </span>
      <span role="cell" class={`p-box ${row.kind}`}>
        <Editor {...{ sheet, row, span, draft, reading, stage, commit, noteId, beginning }} locked={locked} />
      </span>
      <span role="cell" class="p-range">
        <Range
          {...{ row, span, draft, reading, stage, commit, toDefault }}
          frozen={locked || sheet.busy.value !== null}
        />
      </span>
      <Held label={text.rows.ram} value={bare(reading?.ram, span)} extra="p-ram" />
      <Held
        label={text.rows.rom}
        value={row.access === "r" ? "" : bare(reading?.rom, span)}
        extra={romDiffers ? "p-rom strong" : "p-rom"}
      />
      <Default
        row={row}
        value={row.access === "r" ? "" : bare(standard, span)}
        label={text.rows.toDefault(row.label, full(standard, span))}
        able={row.access === "rw" && !locked && sheet.busy.value === null && standard !== null}
        held={reading?.value === standard}
        chosen={current === standard}
        onChoose={toDefault}
      />
      {explained.value && <Help {...{ row, span, reading }} />}
      {!quiet && (
        <Message
          {...{ row, span, draft, outcome, view, onRetry }}
          onUse={value => {
            stage({ text: bare(value, span), verdict: { ok: true, value } });
            commit();
          }}
        />
      )}
    </div>
  );
}

interface DefaultProps {
  row: Row;
  value: string;
  label: string;
  able: boolean;
  /** RAM has it. */
  held: boolean;
  /** The box has it. */
  chosen: boolean;
  onChoose: () => void;
}

/** The default of a row: a press stages it, another one undoes that. Plain text if RAM has it. */
function Default({ row, value, label, able, held, chosen, onChoose }: DefaultProps) {
  if (!able || (held && chosen)) return <Held label={text.rows.default} value={value} extra="p-default" />;
  return (
    <span role="cell" class="p-held p-default">
      <button
        type="button"
        class="to-default"
        aria-label={label}
        aria-pressed={chosen}
        title={label}
        data-testid={`default-${row.key}`}
        onClick={onChoose}
      >
        <svg width="9" height="8" viewBox="-4.5 -1 9 8" aria-hidden="true">
          <path
            d="M0 0l3.6 6.5h-7.2z"
            fill={chosen ? "currentColor" : "none"}
            stroke="currentColor"
            stroke-width="1.2"
          />
        </svg>
        <span class="fold">{text.rows.default} </span>
        {value}
      </button>
    </span>
  );
}

function Held({ label, value, extra }: { label: string; value: string; extra: string }) {
  return (
    <span role="cell" class={`p-held ${extra}`}>
      {value !== "" && <span class="fold">{label} </span>}
      {value}
    </span>
  );
}

interface EditorProps {
  sheet: Sheet;
  row: Row;
  span: ReturnType<typeof spanOf>;
  draft: Draft | undefined;
  reading: { value: unknown; raw: number | null } | undefined;
  locked: boolean;
  noteId: string;
  stage: (draft: Draft) => void;
  commit: () => void;
  beginning: { value: boolean };
}

function Editor({ sheet, row, span, draft, reading, locked, noteId, stage, commit, beginning }: EditorProps) {
  const unread = reading === undefined || reading.raw === null;
  const held = unread ? null : reading.value;
  if (row.access !== "rw") return <span class="fixed">{full(held as never, span)}</span>;
  const inactive = held === null && row.kind === "number";
  const frozen = locked || sheet.busy.value !== null || unread || inactive;
  const selected = draft?.verdict.ok ? draft.verdict.value : held;
  const choose = (value: boolean | string) => {
    stage({ text: String(value), verdict: { ok: true, value } });
    commit();
  };
  if (row.kind === "switch") {
    return (
      <SwitchBox
        id={`box-${row.key}`}
        row={row.key}
        on={typeof selected === "boolean" ? selected : null}
        locked={frozen}
        describedBy={noteId}
        onChange={choose}
      />
    );
  }
  if (row.kind === "choice") {
    return (
      <ChoiceBox
        row={row.key}
        label={row.label}
        choices={row.choices}
        chosen={typeof selected === "string" ? selected : null}
        locked={frozen}
        describedBy={noteId}
        onChoose={choose}
      />
    );
  }
  return (
    <NumberBox
      id={`box-${row.key}`}
      row={row.key}
      span={span}
      held={asNumber(held)}
      draft={draft}
      locked={frozen}
      describedBy={`${noteId} message-${row.key}`}
      onDraft={stage}
      onCommit={commit}
      onRevert={() => sheet.drafts.revert(row.key)}
      onBeginning={value => {
        beginning.value = value;
      }}
    />
  );
}

type RangeProps = Pick<EditorProps, "row" | "span" | "draft" | "stage" | "commit"> & {
  reading: { value: unknown; default: unknown } | undefined;
  frozen: boolean;
  toDefault: () => void;
};

function Range({ row, span, draft, reading, stage, commit, toDefault, frozen }: RangeProps) {
  if (row.kind !== "number" || row.access !== "rw") return null;
  const held = asNumber(reading?.value);
  const standard = asNumber(reading?.default);
  const staged = draft?.verdict.ok && draft.verdict.value !== held ? asNumber(draft.verdict.value) : null;
  const scale = scaleOf(span, [held, standard, staged]);
  if (!scale) return null;
  const code = draft && !draft.verdict.ok ? draft.verdict.code : null;
  const label = text.rows.ruler(full(held, span), full(scale.low, span), full(scale.high, span));
  const beyond = code === "above" || code === "below" ? code : null;
  const drag = (value: number) => {
    const put = nearestAllowed(value, span);
    stage({ text: number(put, decimalsOf(span.perUnit)), verdict: { ok: true, value: put } });
  };
  const way = frozen || held === null ? {} : { onDrag: drag, onDrop: commit, onStandard: toDefault };
  return <Ruler {...{ scale, held, standard, staged, beyond, label }} {...way} />;
}
