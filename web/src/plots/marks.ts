/** Marks in plots: faults, stops, restarts, writes and refusals at their times. */
import { computed, signal } from "@preact/signals";
import { callApi } from "../api/client";
import type { AuditRow } from "../api/config-types";
import { type BenchEvent, events } from "../bench/bench";
import { catalog } from "../bench/catalog";
import { onRefusal } from "../bench/link";
import { poll } from "../bench/poll";
import { KEPT_S, telemetry } from "../telemetry/store";
import type { MarkAt } from "./annotate";
import { plots as words } from "./words";

export interface PlotMark {
  /** Seconds since 1970 UTC. */
  at: number;
  /** Null: all servos on the bus. */
  uid: string | null;
  word: string;
}

const PERIOD_MS = 2000;
const WRITES = new Set(["write", "torque", "save", "restart", "factory_reset"]);

const done = signal<readonly AuditRow[]>([]);
const refused = signal<readonly PlotMark[]>([]);

/** Events that may be visible in a curve. */
export function markOfEvent(one: BenchEvent): PlotMark | null {
  const word = words.mark.event[one.code];
  return word === undefined ? null : { at: one.at, uid: one.uid, word };
}

/** Writes and commands to a servo, with their outcome. */
export function markOfRow(one: AuditRow, address: (key: string) => string): PlotMark | null {
  if (!WRITES.has(one.action)) return null;
  const what = one.key === null ? (words.mark.done[one.action] ?? one.action) : address(one.key);
  const word =
    one.outcome === "refused" || one.outcome === "no_response"
      ? words.mark.refused(what)
      : one.key === null
        ? what
        : words.mark.write(what);
  return { at: one.at, uid: one.uid, word };
}

function addressOf(key: string): string {
  const row = catalog.value?.rows.get(key);
  return row ? `0x${row.address.toString(16).toUpperCase().padStart(2, "0")}` : key;
}

const all = computed<readonly PlotMark[]>(() =>
  [...events.value.map(markOfEvent), ...done.value.map(one => markOfRow(one, addressOf)), ...refused.value]
    .filter(one => one !== null)
    .sort((a, b) => a.at - b.at),
);

/** The marks of these servos on the server's clock, oldest first. */
export function marksOf(uids: ReadonlySet<string>): MarkAt[] {
  const offset = telemetry.utcOffset;
  if (Number.isNaN(offset)) return [];
  return all
    .peek()
    .filter(one => one.uid === null || uids.has(one.uid))
    .map(one => ({ t: one.at - offset, word: one.word }));
}

let watchers = 0;
let stopWatching: () => void = () => undefined;

/** Poll writes and refusals while a plot is visible. Returns a function that ends it. */
export function watchMarks(): () => void {
  if (watchers++ === 0) {
    const looked = poll(PERIOD_MS, look);
    const forget = onRefusal(error => {
      const at = telemetry.serverTime(performance.now() / 1000) + telemetry.utcOffset;
      if (Number.isNaN(at)) return;
      const mark = { at, uid: error.uid ?? null, word: words.mark.refused(words.mark.command) };
      refused.value = [...refused.peek(), mark].filter(one => one.at > at - KEPT_S);
    });
    stopWatching = () => {
      looked.end();
      forget();
    };
  }
  let over = false;
  return () => {
    if (!over && --watchers === 0) stopWatching();
    over = true;
  };
}

async function look(): Promise<void> {
  const since = telemetry.serverTime(performance.now() / 1000) + telemetry.utcOffset - KEPT_S;
  if (Number.isNaN(since)) return;
  try {
    done.value = await callApi("GET", "/audit", { query: { since: Math.round(since), limit: 200 } });
  } catch {
    // Marks of writes are missing then; curves are not affected.
  }
}
