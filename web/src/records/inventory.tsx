import { API, callApi } from "../api/client";
import type { InventoryServo } from "../api/config-types";
import { servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { pathOf, wordInAddress } from "../bench/route";
import { openDrift } from "../change/requests";
import { type Column, DataTable, RowLink } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Empty, instant } from "../kit/loaded";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { text } from "../text";
import { records as words } from "./words";

/** Display name of a servo, on the bus or not. */
export function inventoryNameOf(one: InventoryServo): string {
  return one.label || one.serial || `${one.uid.slice(0, 8)}…`;
}

const head = words.inventory.head;

const columns = (): readonly Column<InventoryServo>[] => [
  {
    key: "servo",
    head: head.servo,
    by: inventoryNameOf,
    cell: one => (
      <>
        <RowLink
          path={pathOf("records", null, `snapshots/${one.uid}`)}
          title={words.inventory.open(inventoryNameOf(one))}
        >
          {inventoryNameOf(one)}
        </RowLink>
        <small>
          {[one.model ?? text.servos.unknownModel, one.label ? one.serial : null].filter(Boolean).join(", ")}
        </small>
      </>
    ),
  },
  { key: "id", head: head.id, right: true, by: one => one.servo_id ?? -1, cell: one => one.servo_id ?? NONE },
  {
    key: "seen",
    head: head.seen,
    by: one => one.last_seen ?? 0,
    cell: one => (
      <>
        {one.last_seen === null ? words.inventory.never : instant(one.last_seen)}
        <small>{servo(one.uid)?.online === true ? words.on : words.off}</small>
      </>
    ),
  },
  {
    key: "snapshots",
    head: head.snapshots,
    right: true,
    by: one => one.snapshots,
    cell: one => one.snapshots,
  },
  {
    key: "drift",
    head: head.drift,
    bare: true,
    cell: one =>
      one.drift.length > 0 && (
        <button
          type="button"
          class="drift-badge"
          onClick={() => {
            openDrift(one.uid);
          }}
        >
          <Glyph kind="warning" size={14} /> {words.inventory.drift}
        </button>
      ),
  },
];

const order = wordInAddress("order");

export function Inventory() {
  const list = useResource(() => callApi("GET", "/inventory"));
  const found = list.value.value;
  return (
    <Scroll label={words.inventory.title} testid="inventory">
      <Loaded of={list} loading={words.loading} />
      {found?.length === 0 && <Empty title={words.inventory.empty}>{words.inventory.emptyLine}</Empty>}
      {found !== null && found.length > 0 && (
        <>
          <DataTable
            label={words.inventory.title}
            rows={found}
            id={one => one.uid}
            data={one => ({ testid: `known-${one.uid}` })}
            order={order}
            columns={columns()}
          />
          <p class="w-line">
            <a class="button" href={`${API}/inventory.csv`} download="">
              <Icon name="download" size={15} /> {words.inventory.csv}
            </a>
          </p>
        </>
      )}
    </Scroll>
  );
}
