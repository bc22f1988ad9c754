/** The benches: state, bus, load, servos, motion control and last contact of each. */

import type { Bench } from "../api/config-types";
import type { Condition, ConditionKind } from "../bench/condition";
import { age, NONE, number, withUnit } from "../bench/format";
import { narrow, phone } from "../bench/screen";
import { sinceContact } from "../bench/site";
import { type Column, DataTable } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import { instant } from "../kit/loaded";
import { ruler } from "../kit/ruler";
import { site as words } from "./words";

const SCALE = 112;

/** Columns without room between a phone, where rows fold, and a desk. */
const WIDE: ReadonlySet<string> = new Set(["load", "control", "version"]);

/** State of a bench in words, the worst first. */
export function stateOf(bench: Bench): Condition {
  const { state, line } = words;
  if (bench.state === "no_contact") {
    const silent = age(sinceContact(bench), 0);
    return { kind: "offline", headline: state.silent(silent), line: line.silent };
  }
  if (bench.state === "stopped")
    return { kind: "offline", headline: state.ended, line: line.ended(instant(bench.last_contact)) };
  if (bench.torque_stopped) return { kind: "warning", headline: state.stopped, line: line.torque };
  if (bench.bus === null) return { kind: "notice", headline: state.noBus, line: "" };
  if (bench.faults > 0) return { kind: "warning", headline: state.active, line: line.faults(bench.faults) };
  return { kind: "ok", headline: state.active, line: line.healthy };
}

const columns = (): readonly Column<Bench>[] => {
  const { head } = words;
  return [
    {
      key: "bench",
      head: head.bench,
      name: true,
      cell: one => (
        <>
          <span class="strong">
            {one.name}
            {one.is_this && (
              <span class={narrow.value && !phone.value ? "hidden-text" : "role-chip"}>{words.here}</span>
            )}
          </span>
          <small>{one.host}</small>
        </>
      ),
    },
    {
      key: "state",
      head: head.state,
      cell: one => {
        const { kind, headline, line } = stateOf(one);
        return (
          <span class="site-state">
            <Glyph kind={kind} />
            <span>
              <span class={kind === "ok" ? "" : "strong"}>{headline}</span>
              {line && <small>{line}</small>}
            </span>
          </span>
        );
      },
    },
    {
      key: "bus",
      head: head.bus,
      cell: one =>
        one.bus === null ? NONE : [one.bus, one.role && words.role[one.role]].filter(Boolean).join(", "),
    },
    { key: "load", head: head.load, cell: one => <Load of={one} /> },
    { key: "servos", head: head.servos, cell: one => <Counts of={one} /> },
    {
      key: "control",
      head: head.control,
      cell: one => (away(one) ? words.unknown : (one.holder ?? <span class="dim">{words.free}</span>)),
    },
    {
      key: "contact",
      head: head.contact,
      right: true,
      look: one => (one.state === "no_contact" ? "strong" : "dim"),
      cell: one => (away(one) ? instant(one.last_contact) : age(sinceContact(one), 0)),
    },
    { key: "version", head: head.version, cell: one => <span class="dim">{one.version}</span> },
    {
      key: "open",
      head: head.open,
      bare: true,
      right: true,
      cell: one =>
        !one.is_this &&
        one.url !== null && (
          <a class="link" href={one.url} target="_blank" rel="noreferrer" title={words.open(one.name)}>
            {words.openWord}
          </a>
        ),
    },
  ];
};

/** Its present state is not known. */
const away = (bench: Bench) => bench.state !== "online";

function Load({ of }: { of: Bench }) {
  const pct = of.bus_load_pct;
  if (away(of) || pct === null) return <span class="dim">{away(of) ? words.unknown : NONE}</span>;
  return (
    <>
      <small>{withUnit(number(pct, 0), "%")}</small>
      <svg class="ruled" width={SCALE + 2} height="14" viewBox={`-1 0 ${SCALE + 2} 14`} aria-hidden="true">
        <path
          d={ruler(SCALE, 10, 9, i => (i % 5 === 0 ? 3 : 5))}
          stroke="var(--edge)"
          stroke-width="1"
          fill="none"
        />
        <path d={`M0 11.5H${(SCALE * Math.min(100, pct)) / 100}`} stroke="var(--ink)" stroke-width="4" />
      </svg>
    </>
  );
}

function Counts({ of }: { of: Bench }) {
  const offline = Math.max(0, of.servos_total - of.servos_online);
  const shown: readonly (readonly [ConditionKind, number, (n: number) => string])[] = [
    ["ok", of.servos_online - of.faults, words.online],
    ["warning", of.faults, words.faulty],
    ["offline", offline, words.offline],
  ];
  return (
    <span class={away(of) ? "counts dim" : "counts"}>
      {shown.map(
        ([kind, n, word]) =>
          n > 0 && (
            <span key={kind} title={word(n)}>
              <Glyph kind={kind} size={14} />
              {n}
              <span class="hidden-text">{word(n)}</span>
            </span>
          ),
      )}
      {of.servos_total === 0 && NONE}
    </span>
  );
}

export function BenchTable({ benches }: { benches: readonly Bench[] | null }) {
  return (
    <DataTable
      label={words.benches}
      rows={benches}
      id={one => one.name}
      data={one => ({ testid: `bench-${one.name}`, here: one.is_this, away: away(one) })}
      columns={columns().filter(one => phone.value || !narrow.value || !WIDE.has(one.key))}
    />
  );
}
