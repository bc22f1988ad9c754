/** What this page did last, on the API page: each request, what came of it, and how to send it from a shell. */
import { useSignal } from "@preact/signals";
import { ROOT } from "../api/root";
import { lastSent, type Sent } from "../api/sent";
import { clock, withUnit } from "../bench/format";
import { Copy } from "../kit/copy";
import { Segments } from "../kit/segments";
import { asCurl } from "./curl";
import { asPython } from "./python";
import { api as words } from "./words";

const said = words.sent;

export function LastSent() {
  const which = useSignal<"changes" | "reads">("changes");
  const shown = lastSent(which.value === "reads");
  return (
    <>
      <div class="a-search">
        <p class="second grow">{said.lead}</p>
        <Segments
          label={said.filter}
          chosen={which.value}
          onChoose={key => {
            which.value = key;
          }}
          options={[
            { key: "changes", label: said.changes },
            { key: "reads", label: said.reads },
          ]}
        />
      </div>
      {shown.length === 0 ? (
        <p class="w-line dim">{which.value === "reads" ? said.noneAll : said.none}</p>
      ) : (
        <table class="table" data-testid="api-sent">
          <caption class="hidden-text">{said.table}</caption>
          <thead>
            <tr>
              <th scope="col">{said.head.at}</th>
              <th scope="col">{said.head.action}</th>
              <th scope="col">{said.head.status}</th>
              <th scope="col">
                <span class="hidden-text">{said.curl}</span>
              </th>
            </tr>
          </thead>
          <tbody>
            {shown.map(one => (
              <Line key={one.number} one={one} />
            ))}
          </tbody>
        </table>
      )}
    </>
  );
}

function Line({ one }: { one: Sent }) {
  const action = `${one.verb} ${one.path}`;
  return (
    <tr>
      <td class="mono">{clock(one.at)}</td>
      <td>
        <span class="mono a-action">{action}</span>
        {one.file !== undefined && <small>{said.file(one.file)}</small>}
        {one.body !== undefined && <small class="mono a-body">{JSON.stringify(one.body)}</small>}
      </td>
      <td class="mono" data-testid="api-status">
        {one.status === null ? "…" : one.status === 0 ? said.noAnswer : one.status}
        {one.took_ms !== null && <small>{withUnit(String(Math.round(one.took_ms)), "ms")}</small>}
      </td>
      <td class="right a-copies">
        <Copy
          what={asCurl(one, location.origin)}
          words={{ copy: said.curl, copied: said.copied }}
          label={said.curlOf(action)}
          testid="api-copy"
        />
        <Copy
          what={asPython(one, location.origin + ROOT)}
          words={{ copy: said.python, copied: said.copied }}
          label={said.pythonOf(action)}
          testid="api-copy-python"
        />
      </td>
    </tr>
  );
}
