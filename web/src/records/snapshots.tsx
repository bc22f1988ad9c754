/** The snapshots of a servo: their values, comparison, and restoring. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { callApi, problemOf } from "../api/client";
import type { InventoryServo, Snapshot } from "../api/config-types";
import { problemText } from "../bench/facts";
import { loaded, servo } from "../bench/fleet";
import { who } from "../bench/holder";
import { pathOf } from "../bench/route";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";
import { narrow } from "../bench/screen";
import { beginChange, type Turn } from "../change/flow";
import { snapshotChange } from "../change/requests";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { DataTable } from "../kit/data-table";
import { Choice, cell, inSet, Tick } from "../kit/field";
import { follow } from "../kit/follow";
import { Done, Empty, instant } from "../kit/loaded";
import { Note } from "../kit/note";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { reasonText } from "../servo/audit-text";
import { inventoryNameOf } from "./inventory";
import { records as words } from "./words";

const strings = words.snapshots;

export function Snapshots({ uid }: { uid: string }) {
  const list = useResource(() => callApi("GET", "/servos/{uid}/snapshots", { path: { uid } }));
  const whole = useResource(() => callApi("GET", "/inventory"));
  const chosen = useSignal<number | null>(null);
  const note = useSignal<string | null>(null);
  const refused = useSignal<string | null>(null);
  const load = () => void list.load();
  const one = whole.value.value?.find(each => each.uid === uid);
  const name = one ? inventoryNameOf(one) : `${uid.slice(0, 8)}…`;
  const found = list.value.value;
  // The inventory was read once; which servos are on the bus is updated continuously.
  const online = servo(uid)?.online === true;
  // What a snapshot is first compared with depends on whether the servo is on the bus.
  const picked =
    one === undefined || !loaded.value ? null : (found?.find(each => each.id === chosen.value) ?? null);
  const take = async () => {
    refused.value = null;
    try {
      const made = await callApi("POST", "/servos/{uid}/snapshots", {
        path: { uid },
        body: {},
        timeout_ms: 30_000,
      });
      note.value = strings.taken;
      load();
      chosen.value = made.id;
    } catch (error) {
      refused.value = problemText(problemOf(error));
    }
  };
  const back = pathOf("records", null, "snapshots");
  const single = narrow.value && picked !== null;
  return (
    <div class="r-split" data-testid="snapshots">
      {!single && (
        <section class="r-list">
          <div class="list-bar">
            <a class="link" href={back} onClick={event => follow(event, back)}>
              {strings.all}
            </a>
            <h2 class="grow">{name}</h2>
            <Button live disabled={!online} testid="take-snapshot" onClick={() => void take()}>
              {strings.take}
            </Button>
          </div>
          <Scroll label={strings.title(name)}>
            <Loaded of={list} />
            <Note band>{refused.value}</Note>
            <Done note={note.value} />
            {one && !online && <p class="w-line second">{strings.offline}</p>}
            {found?.length === 0 && (
              <Empty title={strings.empty} guides={["profiles"]}>
                {strings.emptyLine}
              </Empty>
            )}
            <ul>
              {found?.map(each => (
                <li key={each.id}>
                  <button
                    type="button"
                    class="r-item"
                    aria-pressed={each.id === chosen.value}
                    data-testid={`snapshot-${each.id}`}
                    onClick={() => {
                      chosen.value = each.id;
                      note.value = null;
                    }}
                  >
                    <span class="r-at">{instant(each.at)}</span>
                    <span class="r-why">
                      <span>{reasonText(each.reason, each.reason_code, each.reason_params)}</span>
                      <small>
                        {each.automatic ? strings.automatic : strings.manual}, {strings.by(who(each.by))},{" "}
                        {words.values(Object.keys(each.values).length)}
                      </small>
                    </span>
                  </button>
                </li>
              ))}
            </ul>
          </Scroll>
        </section>
      )}
      {picked ? (
        <Compare
          key={picked.id}
          one={picked}
          name={name}
          online={online}
          others={whole.value.value ?? []}
          snapshots={found ?? []}
          onBack={() => {
            chosen.value = null;
          }}
          onWritten={line => {
            note.value = line;
            load();
          }}
        />
      ) : (
        !narrow.value && <p class="w-line second r-choose">{found && found.length > 0 && strings.choose}</p>
      )}
    </div>
  );
}

interface CompareProps {
  one: Snapshot;
  name: string;
  online: boolean;
  others: readonly InventoryServo[];
  snapshots: readonly Snapshot[];
  onBack: () => void;
  onWritten: (note: string | null) => void;
}

function Compare({ one, name, online, others, snapshots, onBack, onWritten }: CompareProps) {
  const side = useSignal(online ? `servo:${one.uid}` : `rom:${one.uid}`);
  const found = useResource(
    () =>
      callApi("GET", "/compare", {
        query: { left: `snapshot:${one.id}`, right: side.value, identity: true },
      }),
    { of: side.value },
  );
  const profiles = useResource(() => callApi("GET", "/profiles"));
  const ticked = useSignal<ReadonlySet<string>>(new Set());
  const dropping = useSignal(false);
  const note = useSignal<string | null>(null);
  const refused = useSignal<string | null>(null);
  const rows = found.value.value?.differences ?? [];
  // Only values that the snapshot contains can be restored.
  const able = rows.filter(row => row.left_has && row.left !== null).map(row => row.key);
  const usual = rows.filter(row => able.includes(row.key) && !row.identity).map(row => row.key);
  useEffect(() => {
    ticked.value = new Set();
  }, [found.value.value]);
  const restore = async (keys: readonly string[] | null) => {
    refused.value = null;
    const onEnd = (turns: readonly Turn[]) => {
      const [turn] = turns;
      if (turn === undefined || turn.fault === "rolled_back" || turn.fault === "not_written") return;
      note.value = words.write.done(turn.count, name, turn.saved);
      void found.load();
      onWritten(note.value);
    };
    const why = await beginChange(snapshotChange(one.uid, one.id, keys, onEnd));
    if (why !== null) refused.value = words.write.refused(why);
  };
  const model = one.model === null ? [] : [`default:${one.model}${one.firmware ? `@${one.firmware}` : ""}`];
  const options = [
    ...(online ? [{ key: `servo:${one.uid}`, label: strings.now }] : []),
    { key: `rom:${one.uid}`, label: strings.rom },
    ...model.map(key => ({ key, label: strings.default(one.model ?? "") })),
    ...snapshots
      .filter(each => each.id !== one.id)
      .map(each => ({ key: `snapshot:${each.id}`, label: strings.snapshot(instant(each.at)) })),
    ...(profiles.value.value ?? []).map(each => ({
      key: `profile:${each.name}`,
      label: strings.profile(each.name),
    })),
    ...others
      .filter(each => each.uid !== one.uid && each.online)
      .map(each => ({ key: `servo:${each.uid}`, label: strings.servo(inventoryNameOf(each)) })),
  ];
  const all = usual.length > 0 && usual.every(key => ticked.value.has(key));
  return (
    <div class="r-compare" data-testid="compare">
      <div class="list-bar">
        {narrow.value && (
          <Button onClick={onBack} look="plain">
            {strings.back}
          </Button>
        )}
        <h2 class="grow">{strings.of(instant(one.at))}</h2>
        <Choice label={strings.compareWith} at={side} options={options} beside testid="compare-with" />
      </div>
      <Scroll label={strings.of(instant(one.at))}>
        <Loaded of={found} />
        <Done note={note.value} />
        {found.value.value === null && found.problem.value === null && (
          <p class="w-line second">{words.loading}</p>
        )}
        {found.value.value !== null && rows.length === 0 && (
          <Empty title={strings.alike}>{strings.alikeLine(found.value.value.same)}</Empty>
        )}
        {rows.length > 0 && (
          <DataTable
            label={strings.compareWith}
            rows={rows}
            id={row => row.key}
            data={row => ({ testid: `differs-${row.key}` })}
            columns={[
              {
                key: "tick",
                head: strings.tickAll,
                bare: true,
                headCell: (
                  <Tick
                    label={strings.tickAll}
                    bare
                    at={cell(all, on => {
                      ticked.value = new Set(on ? usual : []);
                    })}
                    disabled={usual.length === 0}
                  />
                ),
                cell: row => (
                  <Tick
                    label={strings.tick(rowLabelOf(row.key))}
                    bare
                    at={inSet(ticked, row.key)}
                    disabled={!able.includes(row.key)}
                  />
                ),
              },
              {
                key: "parameter",
                head: strings.head.parameter,
                cell: row => (
                  <>
                    {rowLabelOf(row.key)}
                    <small>
                      {addressOf(row.key)}
                      {row.identity && `, ${strings.identity}`}
                    </small>
                  </>
                ),
              },
              {
                key: "snapshot",
                head: strings.head.snapshot,
                right: true,
                cell: row => (
                  <b>{row.left_has ? valueText(row.key, row.left, row.left_unit) : strings.absent}</b>
                ),
              },
              {
                key: "other",
                head: strings.head.other,
                right: true,
                cell: row => (row.right_has ? valueText(row.key, row.right, row.right_unit) : strings.absent),
              },
            ]}
          />
        )}
        {rows.length > 0 && <p class="w-line dim">{strings.same(found.value.value?.same ?? 0)}</p>}
      </Scroll>
      <div class="wizard-actions">
        <Button
          look="plain"
          live
          onClick={() => {
            dropping.value = true;
          }}
        >
          {strings.drop}
        </Button>
        {refused.value === null ? (
          <span class="grow" />
        ) : (
          <Note testid="restore-refused">{refused.value}</Note>
        )}
        <Button live disabled={!online} testid="restore-all" onClick={() => void restore(null)}>
          {strings.restoreAll}
        </Button>
        <Button
          live
          look="primary"
          testid="restore-ticked"
          disabled={!online || ticked.value.size === 0}
          onClick={() => void restore([...ticked.peek()])}
        >
          {strings.restoreTicked(ticked.value.size)}
        </Button>
      </div>
      {dropping.value && (
        <Confirm
          title={strings.dropTitle(instant(one.at))}
          verb={strings.dropConfirm}
          danger
          act={() =>
            callApi("DELETE", "/servos/{uid}/snapshots/{snapshot_id}", {
              path: { uid: one.uid, snapshot_id: one.id },
            }).then(() => true)
          }
          onClose={done => {
            dropping.value = false;
            if (!done) return;
            onBack();
            onWritten(null);
          }}
        >
          <p>{strings.dropText}</p>
        </Confirm>
      )}
    </div>
  );
}
