/** The node ID table: assignments, pending requests, and the mode of the allocator. */

import { useSignal } from "@preact/signals";
import type { Allocation, AllocatorMode, AllocatorState } from "../api/bus-types";
import { callApi } from "../api/client";
import type { Bus, PendingAllocation } from "../api/types";
import { allocations, ownerName, tableProblem } from "../bench/allocations";
import { bus } from "../bench/bench";
import { now } from "../bench/clock";
import { factsOf } from "../bench/facts";
import { pending } from "../bench/fleet";
import { age, clock, date, grouped } from "../bench/format";
import { up } from "../bench/link";
import { wordInAddress } from "../bench/route";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { DataTable } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import { Empty } from "../kit/loaded";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { Segments } from "../kit/segments";
import { text } from "../text";
import { ForgetDialog, PinDialog } from "./id-dialogs";
import { IdMap } from "./id-map";
import { findingWords as findings, busWords as words } from "./words";

const strings = words.ids;

export function NodeIds({ onChanged }: { onChanged: () => void }) {
  const open = useSignal<{ what: "pin" | "forget"; one: Allocation } | null>(null);
  const done = useSignal<string | null>(null);
  const table = allocations.value;
  const allocator = bus.value?.allocator ?? null;
  const close = (note: string | null) => {
    open.value = null;
    if (note === null) return;
    done.value = note;
    onChanged();
  };
  return (
    <Scroll label={strings.title} testid="node-ids">
      {allocator && <Allocator allocator={allocator} table={table ?? []} />}
      {tableProblem.value !== null && <Note band>{strings.failed(tableProblem.value)}</Note>}
      <Note kind="ok" band testid="ids-note">
        {done.value}
      </Note>
      <Pending />
      <DataTable
        label={strings.title}
        empty={<Empty title={strings.empty}>{strings.emptyLine}</Empty>}
        rows={table}
        id={one => one.uid}
        data={one => ({ testid: `id-${one.uid}`, away: !one.online })}
        old={!up.value}
        order={order}
        columns={[
          { key: "id", head: strings.head.id, right: true, by: one => one.node_id, cell: one => one.node_id },
          {
            key: "name",
            head: strings.head.name,
            by: one => ownerName(one.uid),
            cell: one => (
              <>
                <b>{ownerName(one.uid)}</b>
                <small class="mono">{one.uid}</small>
              </>
            ),
          },
          {
            key: "seen",
            head: strings.head.seen,
            by: one => one.last_seen ?? 0,
            cell: one => (
              <>
                {one.last_seen === null ? strings.never : day(one.last_seen)}
                <small>{one.online ? strings.online : strings.offline}</small>
              </>
            ),
          },
          {
            key: "pinned",
            head: strings.head.pinned,
            by: one => (one.pinned ? 0 : 1),
            cell: one => (
              <span class={one.pinned ? "strong" : "dim"}>
                {one.pinned ? strings.pinned : strings.automatic}
              </span>
            ),
          },
          {
            key: "do",
            head: "",
            bare: true,
            cell: one => (
              <span class="i-do">
                <Button live testid={`pin-${one.uid}`} onClick={() => (open.value = { what: "pin", one })}>
                  {strings.pin}
                </Button>
                <Button
                  live
                  testid={`forget-${one.uid}`}
                  onClick={() => (open.value = { what: "forget", one })}
                >
                  {strings.forget}
                </Button>
              </span>
            ),
          },
        ]}
      />
      {table !== null && <p class="small dim below">{strings.more}</p>}
      {open.value?.what === "pin" && <PinDialog one={open.value.one} table={table ?? []} onClose={close} />}
      {open.value?.what === "forget" && <ForgetDialog one={open.value.one} onClose={close} />}
    </Scroll>
  );
}

const order = wordInAddress("order");

/** "14:02:31" of today, "2026-03-01" of another day. */
function day(utc: number): string {
  return date(utc) === date(Date.now() / 1000) ? clock(utc) : date(utc);
}

function Pending() {
  if (pending.value.length === 0) return null;
  return (
    <ul class="pending" aria-label={strings.waiting(grouped(pending.value.length))}>
      {pending.value.map(one => {
        const passed = Math.max(0, now.value - one.receivedAt);
        return (
          <li key={one.uid_part} class="pending-row" data-testid={`pending-${one.uid_part}`}>
            <Glyph kind={one.refusal === null ? "identifying" : "failure"} />
            <div>
              <p>
                <span class="strong">{text.servos.waiting}</span> <span class="mono dim">{one.uid_part}</span>
              </p>
              <p class="small second">
                {[
                  strings.partsReceived(one.stage),
                  strings.attempts(grouped(one.attempts)),
                  strings.waits(age(one.waiting_s + passed, 0)),
                ].join(text.comma)}
              </p>
              {one.refusal !== null && <p class="small k-failure">{refusalText(one)}</p>}
            </div>
          </li>
        );
      })}
    </ul>
  );
}

/** Why a node gets no node ID. */
function refusalText(one: PendingAllocation): string {
  const known = one.refusal_code && findings.refusal[one.refusal_code];
  return known?.(factsOf(one.refusal_params)) ?? one.refusal ?? "";
}

function Allocator({ allocator, table }: { allocator: AllocatorState; table: readonly Allocation[] }) {
  const confirming = useSignal<AllocatorMode | null>(null);
  const set = async (mode: AllocatorMode) => {
    const changed = await callApi("PUT", "/bus/allocator", { body: { mode } });
    if (bus.value) bus.value = { ...bus.value, allocator: changed } satisfies Bus;
  };
  // A mode that may take a servo off the bus needs a confirmation.
  const choose = (mode: AllocatorMode) => {
    if (mode === allocator.mode || !up.value) return;
    if (mode === "on") void set(mode);
    else confirming.value = mode;
  };
  const competing = allocator.competing_node_id;
  const force = confirming.value === "force";
  return (
    <div class="allocator">
      <div class="allocator-head">
        <span>{strings.mode}</span>
        <Segments<AllocatorMode>
          label={strings.mode}
          chosen={allocator.mode}
          onChoose={choose}
          options={[
            { key: "on", label: strings.modes.on },
            { key: "off", label: strings.modes.off },
            { key: "force", label: strings.modes.force },
          ]}
        />
        <span class="second small" data-testid="allocator-effect">
          {allocator.state !== "standby"
            ? strings.effect[allocator.mode]
            : allocator.own_id_shared
              ? strings.effect.own_id_shared
              : strings.effect.standby}
        </span>
      </div>
      {competing !== null && (
        <p class="competing">
          <Glyph kind="warning" />
          <span>
            <b>{strings.competing(String(competing))}</b> <span class="second">{strings.competingHelp}</span>
          </span>
        </p>
      )}
      <IdMap table={table} />
      <p class="small second" data-testid="ids-used">
        {strings.used(
          grouped(125 - allocator.free),
          grouped(allocator.free),
          grouped(table.filter(one => one.pinned).length),
        )}
      </p>
      {confirming.value !== null && (
        <Confirm
          title={force ? strings.forceTitle : strings.offTitle}
          verb={force ? strings.forceConfirm : strings.offConfirm}
          danger
          testid="allocator-dialog"
          actId="allocator-confirm"
          act={() => set(confirming.peek() ?? "on")}
          onClose={() => {
            confirming.value = null;
          }}
        >
          <p>{force ? strings.forceText : strings.offText}</p>
        </Confirm>
      )}
    </div>
  );
}
