/** The list of all nodes on the bus, servos and others, with notes on them. */

import type { BusNode } from "../api/bus-types";
import { callApi } from "../api/client";
import { now } from "../bench/clock";
import type { ConditionKind } from "../bench/condition";
import { loaded, nameOf, servo } from "../bench/fleet";
import { age, grouped, NONE } from "../bench/format";
import { up } from "../bench/link";
import { noteText } from "../bench/note-text";
import { pathOf, wordInAddress } from "../bench/route";
import { type Column, DataTable, RowLink } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import { Empty } from "../kit/loaded";
import { Note } from "../kit/note";
import { useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { busWords as words } from "./words";

const strings = words.nodes;
const POLL_MS = 2000;

const GLYPH: Record<BusNode["health"], ConditionKind> = {
  ok: "ok",
  warning: "warning",
  error: "failure",
  critical: "failure",
};

export function Nodes() {
  const nodes = useResource(() => callApi("GET", "/nodes"), { every_ms: POLL_MS });
  // Not before the names of servos are known: they change the width of columns.
  const found = loaded.value ? nodes.value.value : null;
  // Nodes that request a node ID are listed together as node 0; without requests it is left out.
  const list = found?.filter(one => one.node_id !== 0 || one.online) ?? null;
  const online = list?.filter(one => one.online).length ?? 0;
  const passed = Math.max(0, now.value - (nodes.readAt.value ?? 0));
  return (
    <Scroll label={strings.title} testid="nodes">
      {nodes.problem.value !== null && <Note band>{strings.failed(nodes.problem.value)}</Note>}
      <DataTable
        label={strings.title}
        empty={<Empty title={strings.empty}>{strings.emptyLine}</Empty>}
        rows={list}
        id={one => one.node_id}
        data={one => ({ testid: `node-${one.node_id}`, kind: one.kind, away: !one.online })}
        old={!up.value}
        order={order}
        columns={columnsOf(passed)}
      />
      {list !== null && list.length > 0 && (
        <p class="small dim below">{strings.summary(grouped(online), grouped(list.length))}</p>
      )}
    </Scroll>
  );
}

const order = wordInAddress("order");

function nodeName(one: BusNode): string {
  const known = one.uid === null ? undefined : servo(one.uid);
  return known ? nameOf(known) : (one.name ?? strings.nameless);
}

function columnsOf(passed: number): readonly Column<BusNode>[] {
  return [
    { key: "id", head: strings.head.id, right: true, by: one => one.node_id, cell: one => one.node_id },
    {
      key: "name",
      head: strings.head.name,
      by: nodeName,
      cell: one => {
        const known = one.uid === null ? undefined : servo(one.uid);
        return (
          <>
            {known ? (
              <RowLink path={pathOf("overview", known.uid)}>{nodeName(one)}</RowLink>
            ) : (
              <b>{nodeName(one)}</b>
            )}
            <small>
              {strings.kind[one.kind]}
              {known && one.name !== null && `, ${one.name}`}
              {one.uid !== null && <span class="mono"> {`${one.uid.slice(0, 4)}…${one.uid.slice(-4)}`}</span>}
            </small>
            {one.note !== null && <small>{noteText(one.note, one.note_code, one.note_params)}</small>}
          </>
        );
      },
    },
    {
      key: "health",
      head: strings.head.health,
      by: one => (one.online ? one.health : ""),
      look: () => "whole-words",
      cell: one => (
        <>
          <Glyph kind={one.online ? GLYPH[one.health] : "offline"} />{" "}
          <span class={!one.online || one.health !== "ok" ? "strong" : ""}>
            {one.online ? strings.health[one.health] : strings.offline}
          </span>
          <small>{strings.mode[one.mode] ?? one.mode}</small>
        </>
      ),
    },
    {
      key: "up",
      head: strings.head.up,
      right: true,
      by: one => one.uptime_s ?? 0,
      cell: one => (
        <>
          {age(one.uptime_s, 0)}
          {one.restarts > 0 && <small>{strings.restarts(grouped(one.restarts))}</small>}
        </>
      ),
    },
    {
      key: "seen",
      head: strings.head.seen,
      right: true,
      by: one => one.age_s,
      cell: one => <span class={one.online ? "" : "strong"}>{age(one.age_s + passed)}</span>,
    },
    {
      key: "version",
      head: strings.head.version,
      cell: one => {
        const [release, commit] = one.software_version?.split("+") ?? [];
        return (
          <>
            {release ?? NONE}
            {commit && <small class="mono">{commit}</small>}
            {one.hardware_version !== null && <small>{strings.hardware(one.hardware_version)}</small>}
          </>
        );
      },
    },
  ];
}
