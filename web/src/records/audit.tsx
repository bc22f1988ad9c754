/** The audit: changes to servos with client and outcome, newest first, with filters. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect } from "preact/hooks";
import { API, callApi } from "../api/client";
import type { AuditRow } from "../api/config-types";
import { catalog } from "../bench/catalog";
import { all, nameOf, servo } from "../bench/fleet";
import { who } from "../bench/holder";
import { wordInAddress } from "../bench/route";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { Button } from "../kit/button";
import { type Column, DataTable } from "../kit/data-table";
import { Choice } from "../kit/field";
import { Icon } from "../kit/icon";
import { Empty, instant } from "../kit/loaded";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { auditedNotes, auditWord } from "../servo/audit-text";
import { records as words } from "./words";

const strings = words.audit;
const PAGE = 200;

const uid = wordInAddress("servo");
const key = wordInAddress("parameter");
const action = wordInAddress("action");

/** The query of an audit with these filters; empty ones are left out. */
export function queryOf(filters: Readonly<Record<string, string | null>>): string {
  const query = new URLSearchParams(
    Object.entries(filters).flatMap(([name, value]) => (value ? [[name, value]] : [])),
  );
  const plain = query.toString();
  return plain === "" ? "" : `?${plain}`;
}

export function Audit() {
  const seen = useSignal<readonly string[]>([]);
  const filters = { uid: uid.value || null, key: key.value || null, action: action.value || null };
  const query = queryOf(filters);
  const list = useResource(() => callApi("GET", "/audit", { query: filters }), { again: query });
  const found = list.value.value;
  // Actions are codes of the server: those seen so far can be selected.
  useEffect(() => {
    const next = new Set([...seen.peek(), ...(found ?? []).map(one => one.action)]);
    if (next.size !== seen.peek().length) seen.value = [...next].sort();
  }, [found]);
  const older = () => {
    const last = found?.at(-1);
    if (!found || !last) return;
    void list.load(async () => {
      const more = await callApi("GET", "/audit", { query: { ...filters, before_id: last.id } });
      return [...found, ...more];
    });
  };
  const any = { key: "", label: strings.any };
  const actions = action.value === "" || seen.value.includes(action.value) ? seen.value : [action.value];
  return (
    <>
      <div class="list-bar r-tools">
        <Choice
          label={strings.servo}
          at={uid}
          testid="audit-servo"
          options={[any, ...all.value.map(one => ({ key: one.uid, label: nameOf(one) }))]}
          beside
        />
        <Choice
          label={strings.key}
          at={key}
          testid="audit-key"
          options={[
            any,
            ...[...(catalog.value?.rows.values() ?? [])]
              .filter(row => row.access !== "r")
              .map(row => ({ key: row.key, label: `${row.label} ${row.name}` })),
          ]}
          beside
        />
        <Choice
          label={strings.action}
          at={action}
          testid="audit-action"
          options={[any, ...actions.map(word => ({ key: word, label: auditWord(word) }))]}
          beside
        />
        <span class="grow" />
        <a class="button" href={`${API}/audit.csv${query}`} download="" data-testid="audit-csv">
          <Icon name="download" size={15} /> {strings.csv}
        </a>
      </div>
      <Scroll label={words.auditTab} testid="audit">
        <Loaded of={list} />
        {found === null && list.problem.value === null && <p class="w-line second">{words.loading}</p>}
        <DataTable
          label={words.auditTab}
          rows={found}
          id={one => one.id}
          data={one => ({ testid: `audit-${one.id}` })}
          columns={columns()}
          empty={
            query === "" ? (
              <Empty title={strings.empty}>{strings.emptyLine}</Empty>
            ) : (
              <p class="w-line second">{strings.nothing}</p>
            )
          }
        />
        {found !== null && found.length >= PAGE && found.length % PAGE === 0 && (
          <p class="w-line">
            <Button live onClick={older}>
              {strings.more}
            </Button>
          </p>
        )}
      </Scroll>
    </>
  );
}

const WELL = new Set([
  "taken",
  "released",
  "accepted",
  "applied",
  "succeeded",
  "verified",
  "unchanged",
  "ok",
  "done",
]);

const SNAPSHOT = new Set(["save", "restart", "factory_reset", "snapshot"]);

const columns = (): readonly Column<AuditRow>[] => [
  {
    key: "at",
    head: strings.head.at,
    cell: one => (
      <>
        {instant(one.at)}
        <small>{who(one.by)}</small>
      </>
    ),
  },
  {
    key: "what",
    head: strings.head.what,
    cell: ({ action: done, key: row }) => (
      <>
        {auditWord(done)}
        {row && (
          <small>
            {rowLabelOf(row)} {addressOf(row)}
          </small>
        )}
      </>
    ),
  },
  {
    key: "servo",
    head: strings.head.servo,
    cell: one => one.uid !== null && (nameOf(servo(one.uid)) || `${one.uid.slice(0, 8)}…`),
  },
  { key: "change", head: strings.head.change, cell: changeOf },
  {
    key: "outcome",
    head: strings.head.outcome,
    cell: one => (
      <>
        <span class={WELL.has(one.outcome) ? "" : "strong"}>{auditWord(one.outcome)}</span>
        {auditedNotes(one).map(note => (
          <small key={note}>{note}</small>
        ))}
      </>
    ),
  },
];

function changeOf(one: AuditRow): ComponentChildren {
  const row = one.key ?? "";
  const show = (value: unknown) => valueText(row, value);
  // The value is the number of a snapshot, not a changed value.
  const changed = !(row === "" && SNAPSHOT.has(one.action)) && (one.after != null || one.before != null);
  if (!changed) return one.requested != null && show(one.requested);
  return (
    <>
      {strings.changed(show(one.before), show(one.after))}
      {one.requested != null && show(one.requested) !== show(one.after) && (
        <small>{strings.requested(show(one.requested))}</small>
      )}
    </>
  );
}
