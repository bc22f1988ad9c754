/** Details of the selected row of the monitor: fields, payload, and buttons that filter by it. */
import { number } from "../bench/format";
import { Button } from "../kit/button";
import { withWord } from "./frame-filter";
import { endsOf, frameLineOf, leaves, shortType, spaced } from "./frame-text";
import { box, chosenFrame, feed } from "./monitor-state";
import { busWords as words } from "./words";

const strings = words.monitor.detail;
const MOST_FIELDS = 80;

export function FrameDetail() {
  const at = chosenFrame.value;
  const row = at === null ? undefined : feed.at(at);
  if (!row || row.kind === "gap") return null;
  const line = frameLineOf(row, false);
  const id = row.kind === "transfer" ? row.transfer.can_id : row.frame.can_id;
  const { source, destination } = endsOf(id);
  const type = row.kind === "transfer" && row.transfer.type !== null ? shortType(row.transfer.type) : null;
  const nodes = [source, ...(destination === null ? [] : [destination])];
  return (
    <section
      class="frame-detail"
      aria-label={row.kind === "transfer" ? strings.title : strings.titleFrame}
      data-testid="frame-detail"
    >
      <header>
        <b>{line.head || words.monitor.frames}</b>
        <span class="second small mono">{line.time}</span>
        <span class="second small">{line.route}</span>
        <span class="grow" />
        <span class="narrowers">
          {nodes.map(node => (
            <Button key={node} onClick={() => narrow("node", node)}>
              {strings.onlyNode(node)}
            </Button>
          ))}
          {type !== null && <Button onClick={() => narrow("type", type)}>{strings.onlyType(type)}</Button>}
        </span>
        <Button
          testid="detail-close"
          onClick={() => {
            chosenFrame.value = null;
          }}
        >
          {strings.close}
        </Button>
      </header>
      {line.text !== "" && <p class="detail-text">{line.text}</p>}
      <dl>
        {row.kind === "transfer" ? (
          <>
            {row.transfer.fields === null && <p class="second">{strings.noFields}</p>}
            {leaves(row.transfer.fields ?? {}, MOST_FIELDS).map(leaf => (
              <Pair key={leaf.name} name={leaf.name} value={leaf.value} mono />
            ))}
            <Pair
              name={strings.dataType}
              value={`${row.transfer.type ?? words.monitor.unknownType(row.transfer.data_type_id)}, ${row.transfer.data_type_id}`}
            />
            <Pair name={strings.priority} value={number(row.transfer.priority, 0)} />
            <Pair name={strings.transferId} value={number(row.transfer.transfer_id, 0)} />
            <Pair name={strings.identifier} value={line.id} mono />
            <Pair name={strings.size} value={line.size} />
            <Pair name={strings.payload} value={spaced(row.transfer.payload) || strings.empty} mono />
          </>
        ) : (
          <>
            {row.frame.problem !== null && <Pair name={words.monitor.notDecoded} value={row.frame.problem} />}
            <Pair name={strings.identifier} value={line.id} mono />
            <Pair name={strings.size} value={line.size} />
            <Pair name={strings.payload} value={spaced(row.frame.data)} mono />
          </>
        )}
      </dl>
    </section>
  );
}

function narrow(key: "node" | "type", value: string | number): void {
  box.value = withWord(box.peek(), key, value);
}

function Pair({ name, value, mono }: { name: string; value: string; mono?: boolean }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd class={mono ? "mono" : ""}>{value}</dd>
    </div>
  );
}
