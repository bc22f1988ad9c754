/** Recent requests on the API page: each request, its result, and how to send it from a shell. */
import { useSignal } from "@preact/signals";
import { ROOT } from "../api/root";
import { lastSent, type Sent } from "../api/sent";
import { clock, withUnit } from "../bench/format";
import { Copy } from "../kit/copy";
import { type Column, DataTable } from "../kit/data-table";
import { Segments } from "../kit/segments";
import { asCurl } from "./curl";
import { asPython } from "./python";
import { api as words } from "./words";

const strings = words.sent;

export function LastSent() {
  const which = useSignal<"changes" | "reads">("changes");
  const shown = lastSent(which.value === "reads");
  return (
    <>
      <div class="a-search">
        <p class="second grow">{strings.lead}</p>
        <Segments
          label={strings.filter}
          chosen={which.value}
          onChoose={key => {
            which.value = key;
          }}
          options={[
            { key: "changes", label: strings.changes },
            { key: "reads", label: strings.reads },
          ]}
        />
      </div>
      <DataTable
        label={strings.table}
        testid="api-sent"
        rows={shown}
        id={one => one.number}
        empty={<p class="w-line dim">{which.value === "reads" ? strings.noneAll : strings.none}</p>}
        columns={columns()}
      />
    </>
  );
}

const columns = (): readonly Column<Sent>[] => [
  { key: "at", head: strings.head.at, look: () => "mono", cell: one => clock(one.at) },
  {
    key: "action",
    head: strings.head.action,
    cell: one => (
      <>
        <span class="mono a-action">{actionOf(one)}</span>
        {one.file !== undefined && <small>{strings.file(one.file)}</small>}
        {one.body !== undefined && <small class="mono a-body">{JSON.stringify(one.body)}</small>}
      </>
    ),
  },
  {
    key: "status",
    head: strings.head.status,
    look: () => "mono",
    cell: one => (
      <span data-testid="api-status">
        {one.status === null ? "…" : one.status === 0 ? strings.noResponse : one.status}
        {one.took_ms !== null && <small>{withUnit(String(Math.round(one.took_ms)), "ms")}</small>}
      </span>
    ),
  },
  {
    key: "copies",
    head: strings.curl,
    bare: true,
    look: () => "a-copies",
    cell: one => (
      <>
        <Copy
          what={asCurl(one, location.origin)}
          words={{ copy: strings.curl, copied: strings.copied }}
          label={strings.curlOf(actionOf(one))}
          testid="api-copy"
        />
        <Copy
          what={asPython(one, location.origin + ROOT)}
          words={{ copy: strings.python, copied: strings.copied }}
          label={strings.pythonOf(actionOf(one))}
          testid="api-copy-python"
        />
      </>
    ),
  },
];

const actionOf = (one: Sent) => `${one.verb} ${one.path}`;
