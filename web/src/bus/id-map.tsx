/** Scale of all node IDs: which are in use, online, and pinned. */
import type { Allocation } from "../api/bus-types";
import { all } from "../bench/fleet";
import { busWords as words } from "./words";

const LAST = 127;
const LABELS = [1, 25, 50, 75, 100, 125];
const BASE = 24;

/** Position of an ID, with half a place free at both ends. */
const place = (id: number) => `${(((id - 0.5) / LAST) * 100).toFixed(2)}%`;

/** One mark per ID: tall if its node is online, short if it is assigned to an offline node. */
export function IdMap({ table }: { table: readonly Allocation[] }) {
  const assigned = new Map(table.map(one => [one.node_id, one]));
  const online = new Set(all.value.flatMap(one => (one.online && one.node_id !== null ? [one.node_id] : [])));
  for (const one of table) if (one.online) online.add(one.node_id);
  const taken = [...new Set([...assigned.keys(), ...online])].sort((a, b) => a - b);
  return (
    <svg class="id-map" width="100%" height="44" role="img" aria-label={words.ids.map(taken.join(", "))}>
      <line x1="0" x2="100%" y1={BASE + 0.5} y2={BASE + 0.5} stroke="var(--edge)" />
      {LABELS.map(id => (
        <line key={id} x1={place(id)} x2={place(id)} y1={BASE} y2={BASE + 6} stroke="var(--edge)" />
      ))}
      {taken.map(id => (
        <line
          key={id}
          x1={place(id)}
          x2={place(id)}
          y1={online.has(id) ? 8 : 16}
          y2={BASE}
          stroke={online.has(id) ? "var(--ink)" : "var(--ink-3)"}
          stroke-width="3"
        />
      ))}
      {taken.map(
        id => assigned.get(id)?.pinned && <circle key={id} cx={place(id)} cy="3" r="2.5" fill="var(--ink)" />,
      )}
      {LABELS.map(id => (
        <text
          key={id}
          x={place(id)}
          y={BASE + 18}
          text-anchor={id === LABELS[0] ? "start" : id === LABELS.at(-1) ? "end" : "middle"}
        >
          {id}
        </text>
      ))}
    </svg>
  );
}
