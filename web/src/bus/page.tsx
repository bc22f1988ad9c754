/** The Bus page: head, load and counters, the doctor, and beside it monitor, nodes and node IDs. */
import { useEffect, useRef } from "preact/hooks";
import { watchAllocations } from "../bench/allocations";
import { bus } from "../bench/bench";
import { complaints, watchDoctor } from "../bench/doctor";
import type { Poll } from "../bench/poll";
import { changeChoices } from "../bench/route";
import { narrow } from "../bench/screen";
import { Glyph } from "../kit/glyph";
import { lazy } from "../kit/lazy";
import { LoadingPage } from "../kit/loaded";
import { Panel } from "../kit/panel";
import { tabKeys } from "../kit/tab-keys";
import { ConnectHere } from "./connect";
import { BusStrip } from "./counters";
import { Doctor } from "./doctor";
import { BusHead } from "./head";
import { NodeIds } from "./ids";
import { watchLog } from "./log";
import { Monitor } from "./monitor";
import { Nodes } from "./nodes";
import { busWords as words } from "./words";
import "./bus.css";
import "./monitor.css";
import "./connect.css";

const AutopilotPart = lazy(() => import("../autopilot/part").then(file => file.AutopilotPart));

type Part = "doctor" | "monitor" | "nodes" | "ids" | "autopilot";

export function BusPage({ hash }: { hash: string }) {
  const doctor = useRef<Poll | null>(null);
  const table = useRef<Poll | null>(null);
  useEffect(() => {
    const polls = [watchDoctor(), watchAllocations(), watchLog()] as const;
    [doctor.current, table.current] = polls;
    return () => {
      for (const one of polls) one.end();
    };
  }, []);
  const check = () => doctor.current?.now();
  const parts: readonly Part[] = narrow.value
    ? ["doctor", "monitor", "nodes", "ids", "autopilot"]
    : ["monitor", "nodes", "ids", "autopilot"];
  const part = parts.find(one => one === hash) ?? parts[0];
  // Its tables need the whole width.
  const whole = narrow.value || part === "autopilot";
  if (bus.value === null) return <LoadingPage />;
  if (bus.value.state === "disconnected") {
    return (
      <div class="page" data-testid="bus-page">
        <BusHead />
        <div class="bus-split">
          {!narrow.value && (
            <Panel>
              <Doctor onCheck={check} />
            </Panel>
          )}
          <div class="scroll">
            <ConnectHere />
            {narrow.value && <Doctor onCheck={check} />}
          </div>
        </div>
      </div>
    );
  }
  return (
    <div class="page" data-testid="bus-page">
      <BusHead />
      {!whole && (
        <Panel>
          <BusStrip />
        </Panel>
      )}
      <div class={whole ? "bus-split whole" : "bus-split"}>
        {!whole && (
          <Panel>
            <Doctor onCheck={check} />
          </Panel>
        )}
        <div class="bus-parts">
          <Parts parts={parts} chosen={part} />
          <Panel key={part}>
            {part === "doctor" && (
              <div class="scroll">
                <BusStrip />
                <Doctor onCheck={check} />
              </div>
            )}
            {part === "monitor" && <Monitor />}
            {part === "nodes" && <Nodes />}
            {part === "autopilot" && <AutopilotPart />}
            {part === "ids" && <NodeIds onChanged={() => table.current?.now()} />}
          </Panel>
        </div>
      </div>
    </div>
  );
}

const NAMES = (): Record<Part, string> => ({
  doctor: words.doctorTab,
  monitor: words.monitorTab,
  nodes: words.nodesTab,
  ids: words.idsTab,
  autopilot: words.autopilotTab,
});

function Parts({ parts, chosen }: { parts: readonly Part[]; chosen: Part | undefined }) {
  const open = (part: Part) => changeChoices({}, part);
  const { failure, warning } = complaints.value;
  return (
    <div class="tabs">
      <div role="tablist" aria-label={words.parts} tabIndex={-1} onKeyDown={tabKeys}>
        {parts.map(part => (
          <button
            key={part}
            type="button"
            role="tab"
            aria-selected={part === chosen}
            tabIndex={part === chosen ? 0 : -1}
            data-testid={`part-${part}`}
            onClick={() => open(part)}
          >
            {NAMES()[part]}
            {part === "doctor" && failure + warning > 0 && (
              <span class="count">
                <Glyph kind={failure > 0 ? "failure" : "warning"} size={13} /> {failure || warning}
              </span>
            )}
          </button>
        ))}
      </div>
    </div>
  );
}
