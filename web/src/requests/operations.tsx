/** The operations of the API page: read from the server's own OpenAPI document, to search and to unfold. */
import { useComputed, useSignal } from "@preact/signals";
import { Button } from "../kit/button";
import { DataTable } from "../kit/data-table";
import { Unread } from "../kit/loaded";
import { Search } from "../kit/search";
import { matching, type Operation, operationsOf } from "./document";
import { openApi, openApiTrouble, readOpenApi } from "./open-api";
import { api as words } from "./words";

const said = words.operations;

/** So many are drawn at first; a search finds the others. */
const DRAWN = 60;

export function Operations() {
  const search = useSignal("");
  const whole = useSignal(false);
  const operations = useComputed(() => openApi.value && operationsOf(openApi.value, said.list));
  if (openApiTrouble.value !== null)
    return <Unread why={openApiTrouble.value} said={said.failed} onAgain={() => void readOpenApi()} />;
  const all = operations.value;
  if (all === null)
    return (
      <p class="w-line second" role="status">
        {said.loading}
      </p>
    );
  const found = matching(all, search.value);
  const shown = whole.value ? found : found.slice(0, DRAWN);
  return (
    <>
      <div class="a-search">
        <Search
          label={said.search}
          value={search.value}
          onInput={value => {
            search.value = value;
          }}
        />
        <span class="second" role="status" data-testid="api-found">
          {said.found(found.length, all.length)}
        </span>
      </div>
      {found.length === 0 && <p class="w-line second">{said.none(search.value)}</p>}
      <ul class="a-operations">
        {shown.map(one => (
          <li key={`${one.verb} ${one.path}`}>
            <One one={one} />
          </li>
        ))}
      </ul>
      {shown.length < found.length && (
        <div class="w-line">
          <Button
            onClick={() => {
              whole.value = true;
            }}
          >
            {said.all(found.length)}
          </Button>
        </div>
      )}
    </>
  );
}

function One({ one }: { one: Operation }) {
  const open = useSignal(false);
  return (
    <details
      onToggle={event => {
        open.value = event.currentTarget.open;
      }}
    >
      <summary>
        <b class="a-verb mono">{one.verb}</b>
        <span class="a-path mono">{one.path}</span>
        <span class="a-what second">{one.summary}</span>
      </summary>
      {open.value && <Detail one={one} />}
    </details>
  );
}

function Detail({ one }: { one: Operation }) {
  return (
    <div class="a-detail">
      <p class="second">{one.summary}</p>
      <DataTable
        label={said.parameters}
        rows={one.arguments}
        id={argument => argument.where + argument.name}
        empty={<p class="dim">{said.noParameters}</p>}
        columns={[
          { key: "name", head: said.head.name, look: () => "mono", cell: argument => argument.name },
          {
            key: "where",
            head: said.head.where,
            cell: argument => (
              <>
                {said.where[argument.where] ?? argument.where}
                {argument.required && <small>{said.required}</small>}
              </>
            ),
          },
          { key: "type", head: said.head.type, look: () => "mono", cell: argument => argument.type },
          { key: "what", head: said.head.what, cell: argument => argument.what },
        ]}
      />
      {one.body !== null && (
        <p>
          <span class="second">{said.body}</span> <span class="mono">{one.body}</span>
        </p>
      )}
      <h4 class="second">{said.answers}</h4>
      <dl class="a-answers">
        {one.answers.map(answer => (
          <div key={answer.status}>
            <dt class="mono">{answer.status}</dt>
            <dd class="mono">{answer.what}</dd>
          </div>
        ))}
      </dl>
    </div>
  );
}
