/** The list of every servo ever met, on the bus or not: the way to its snapshots. */
import { useEffect, useMemo } from "preact/hooks";
import { API, ask } from "../api/client";
import type { InventoryServo } from "../api/config-types";
import { Asked } from "../bench/asked";
import { servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { connection } from "../bench/link";
import { pathOf } from "../bench/route";
import { openDrift } from "../change/requests";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Empty, instant, Unread } from "../kit/loaded";
import { Scroll } from "../kit/scroll";
import { text } from "../text";
import { records as words } from "../text/topics";

/** What to call a servo, on the bus or not. */
export function inventoryNameOf(one: InventoryServo): string {
  return one.label || one.serial || `${one.uid.slice(0, 8)}…`;
}

export function Inventory() {
  const list = useMemo(() => new Asked<InventoryServo[]>(), []);
  const load = () => void list.load(() => ask<InventoryServo[]>("GET", "/inventory"));
  const round = connection.value;
  useEffect(load, [round]);
  const head = words.inventory.head;
  const found = list.value.value;
  return (
    <Scroll label={words.inventory.title} testid="inventory">
      <Unread why={list.problem.value} onAgain={load} />
      {found === null && list.problem.value === null && <p class="w-line second">{words.loading}</p>}
      {found?.length === 0 && <Empty title={words.inventory.empty}>{words.inventory.emptyLine}</Empty>}
      {found !== null && found.length > 0 && (
        <>
          <table class="c-table r-inventory" aria-label={words.inventory.title}>
            <thead>
              <tr>
                <th>{head.servo}</th>
                <th class="right">{head.id}</th>
                <th>{head.seen}</th>
                <th class="right">{head.snapshots}</th>
                <th>
                  <span class="hidden-text">{head.drift}</span>
                </th>
              </tr>
            </thead>
            <tbody>
              {found.map(one => {
                const path = pathOf("records", null, `snapshots/${one.uid}`);
                return (
                  <tr key={one.uid} class="r-row" data-testid={`known-${one.uid}`}>
                    <td>
                      <a
                        class="row-link strong"
                        href={path}
                        title={words.inventory.open(inventoryNameOf(one))}
                        onClick={event => follow(event, path)}
                      >
                        {inventoryNameOf(one)}
                      </a>
                      <small>
                        {[one.model ?? text.servos.unknownModel, one.label ? one.serial : null]
                          .filter(Boolean)
                          .join(", ")}
                      </small>
                    </td>
                    <td class="right">{one.servo_id ?? NONE}</td>
                    <td>
                      {one.last_seen === null ? words.inventory.never : instant(one.last_seen)}
                      <small>{servo(one.uid)?.online === true ? words.on : words.off}</small>
                    </td>
                    <td class="right">{one.snapshots}</td>
                    <td>
                      {one.drift.length > 0 && (
                        <button
                          type="button"
                          class="drift-badge"
                          onClick={() => {
                            openDrift(one.uid);
                          }}
                        >
                          <Glyph kind="warning" size={14} /> {words.inventory.drift}
                        </button>
                      )}
                    </td>
                  </tr>
                );
              })}
            </tbody>
          </table>
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
