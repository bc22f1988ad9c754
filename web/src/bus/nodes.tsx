/** The list of all nodes of the bus, servos and others, with what is odd about them. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { BusNode } from "../api/bus-types";
import { ask, problemOf } from "../api/client";
import { monotonic, now } from "../bench/clock";
import type { ConditionKind } from "../bench/condition";
import { problemText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { age, grouped, NONE } from "../bench/format";
import { up } from "../bench/link";
import { noteText } from "../bench/note-text";
import { poll } from "../bench/poll";
import { pathOf } from "../bench/route";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { bus as words } from "../text/topics";

const said = words.nodes;
const ASK_MS = 2000;

const GLYPH: Record<BusNode["health"], ConditionKind> = {
  ok: "ok",
  warning: "warning",
  error: "failure",
  critical: "failure",
};

export function Nodes() {
  const nodes = useSignal<readonly BusNode[] | null>(null);
  const readAt = useSignal(0);
  const problem = useSignal<string | null>(null);
  useEffect(() => {
    const look = async () => {
      try {
        nodes.value = await ask<BusNode[]>("GET", "/nodes");
        readAt.value = monotonic();
        problem.value = null;
      } catch (error) {
        problem.value = problemText(problemOf(error));
      }
    };
    return poll(ASK_MS, look).end;
  }, []);
  // Those who ask for a node id stand together as node 0; once nobody asks there is nothing to tell of them.
  const list = nodes.value?.filter(one => one.node_id !== 0 || one.online) ?? null;
  const online = list?.filter(one => one.online).length ?? 0;
  const passed = Math.max(0, now.value - readAt.value);
  return (
    <Scroll label={said.title} testid="nodes">
      {problem.value !== null && <Note band>{said.failed(problem.value)}</Note>}
      {list !== null && list.length === 0 && (
        <div class="part-empty">
          <p class="strong">{said.empty}</p>
          <p class="second">{said.emptyLine}</p>
        </div>
      )}
      {list !== null && list.length > 0 && (
        <div role="table" aria-label={said.title} class={up.value ? "" : "old"}>
          <div role="row" class="n-grid n-head">
            {(["id", "name", "health", "up", "heard", "version"] as const).map(key => (
              <span key={key} role="columnheader" class={`n-${key}`}>
                {said.head[key]}
              </span>
            ))}
          </div>
          {list.map(one => (
            <NodeRow key={one.node_id} one={one} passed={passed} />
          ))}
        </div>
      )}
      {list !== null && list.length > 0 && (
        <p class="small dim below">{said.summary(grouped(online), grouped(list.length))}</p>
      )}
    </Scroll>
  );
}

function NodeRow({ one, passed }: { one: BusNode; passed: number }) {
  const known = one.uid === null ? undefined : servo(one.uid);
  const name = known ? nameOf(known) : (one.name ?? said.nameless);
  const path = known ? pathOf("parameters", known.uid) : null;
  const away = !one.online;
  const [release, commit] = one.software_version?.split("+") ?? [];
  return (
    <div
      role="row"
      class={away ? "n-grid n-row away" : "n-grid n-row"}
      data-testid={`node-${one.node_id}`}
      data-kind={one.kind}
    >
      <span role="cell" class="n-id">
        {one.node_id}
      </span>
      <span role="cell" class="n-name">
        {path === null ? (
          <span class="strong">{name}</span>
        ) : (
          <a class="row-link strong" href={path} onClick={event => follow(event, path)}>
            {name}
          </a>
        )}
        <small>
          {said.kind[one.kind]}
          {known && one.name !== null && `, ${one.name}`}
          {one.uid !== null && <span class="mono"> {`${one.uid.slice(0, 4)}…${one.uid.slice(-4)}`}</span>}
        </small>
        {one.note !== null && (
          <small class="n-note">{noteText(one.note, one.note_code, one.note_params)}</small>
        )}
      </span>
      <span role="cell" class="n-health">
        <Glyph kind={away ? "offline" : GLYPH[one.health]} />
        <span>
          <span class={away || one.health !== "ok" ? "strong" : ""}>
            {away ? said.offline : said.health[one.health]}
          </span>
          <small>{one.mode}</small>
        </span>
      </span>
      <span role="cell" class="n-up">
        {age(one.uptime_s, 0)}
        <small>{one.restarts > 0 ? said.restarts(grouped(one.restarts)) : ""}</small>
      </span>
      <span role="cell" class={away ? "n-heard strong" : "n-heard"}>
        {age(one.age_s + passed)}
      </span>
      <span role="cell" class="n-version">
        {release ?? NONE}
        {commit && <small class="mono">{commit}</small>}
        {one.hardware_version !== null && <small>{said.hardware(one.hardware_version)}</small>}
      </span>
    </div>
  );
}
