/** Every servo of the site, wherever it is: live on this bench, otherwise as last seen. */

import type { Bench, InventoryServo } from "../api/config-types";
import { browserSetting } from "../bench/browser-setting";
import { now } from "../bench/clock";
import { type Condition, needsAttention } from "../bench/condition";
import { type KnownServo, servo } from "../bench/fleet";
import { age, angle, NONE } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { romKnown } from "../bench/parameters";
import { oneInAddress, pathOf, wordInAddress } from "../bench/route";
import { narrow, phone } from "../bench/screen";
import { conditionHere } from "../bench/servo-condition";
import { benches, sinceContact } from "../bench/site";
import { type Column, DataTable, RowLink } from "../kit/data-table";
import { Dial } from "../kit/dial";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { instant } from "../kit/loaded";
import { Search } from "../kit/search";
import { Segments } from "../kit/segments";
import { LiveDial } from "../servo/live-dial";
import { isSearched, matchOf } from "./search";
import { site as words } from "./words";

/** Columns without room between a phone, where rows fold, and a desk. */
const WIDE: ReadonlySet<string> = new Set(["model", "ids", "firmware", "rom"]);

const FILTERS = ["all", "here", "attention"] as const;
type Filter = (typeof FILTERS)[number];

const wanted = wordInAddress("q");
const filter = oneInAddress("filter", FILTERS);
const order = wordInAddress("order");
const density = browserSetting<"list" | "compact">("hornbill.site-density", kept =>
  kept === "list" ? "list" : "compact",
);

/** The servo on this bench's bus now; undefined if it is not. */
const live = (one: InventoryServo): KnownServo | undefined => {
  const here = servo(one.uid);
  return here?.online ? here : undefined;
};

function healthOf(one: InventoryServo): Condition {
  const here = live(one);
  if (here) return conditionHere(here);
  const at = benchOf(one);
  const strings = words.servos;
  if (at?.state === "no_contact")
    return { kind: "offline", headline: strings.silent(age(sinceContact(at), 0)), line: "" };
  if (at?.state === "online" && !at.is_this)
    return { kind: "offline", headline: strings.left(at.name), line: "" };
  return {
    kind: "offline",
    headline: strings.away,
    line: one.bench === null ? "" : strings.left(one.bench),
  };
}

const benchOf = (one: InventoryServo): Bench | undefined =>
  benches.value.value?.find(bench => bench.name === one.bench);

const wants = (one: InventoryServo) => {
  const here = live(one);
  return one.drift.length > 0 || (here !== undefined && needsAttention(conditionHere(here).kind));
};

const columns = (): readonly Column<InventoryServo>[] => {
  const { head } = words.servos;
  const mark = (text: string | null) => <Marked of={text ?? NONE} />;
  return [
    {
      key: "serial",
      head: head.serial,
      name: true,
      by: one => one.serial ?? "",
      cell: one =>
        servo(one.uid) ? (
          <RowLink path={pathOf("overview", one.uid)}>{mark(one.serial ?? shortUid(one))}</RowLink>
        ) : (
          mark(one.serial ?? shortUid(one))
        ),
    },
    { key: "dial", head: head.angle, bare: true, cell: one => <SmallDial of={one} /> },
    { key: "angle", head: head.angle, right: true, cell: one => <AngleCell of={one} /> },
    {
      key: "servo",
      head: head.servo,
      by: one => one.label,
      cell: one => <span class="strong">{mark(one.label || null)}</span>,
    },
    { key: "model", head: head.model, by: one => one.model ?? "", cell: one => one.model ?? NONE },
    {
      key: "bench",
      head: head.bench,
      by: one => one.bench ?? "",
      look: one => (live(one) ? "strong" : ""),
      cell: one => one.bench ?? words.servos.noBench,
    },
    {
      key: "ids",
      head: head.ids,
      cell: one => (
        <>
          {one.servo_id ?? NONE} <span class="dim">/</span> {one.node_id ?? NONE}
        </>
      ),
    },
    {
      key: "health",
      head: head.health,
      cell: one => {
        const { kind, headline, line } = healthOf(one);
        return (
          <span class="site-state" title={[headline, line].filter(Boolean).join(". ")}>
            <Glyph kind={kind} />
            <span class={kind === "ok" || kind === "offline" ? "" : "strong"}>{headline}</span>
            {line && <small>{line}</small>}
          </span>
        );
      },
    },
    {
      key: "firmware",
      head: head.firmware,
      look: () => "dim",
      by: one => one.firmware ?? "",
      cell: one => one.firmware ?? NONE,
    },
    { key: "rom", head: head.rom, cell: one => <RomCell of={one} /> },
    {
      key: "contact",
      head: head.contact,
      right: true,
      look: one => (live(one) ? "dim" : ""),
      by: one => one.last_seen ?? 0,
      cell: one => <ContactCell of={one} />,
    },
  ];
};

const shortUid = (one: InventoryServo) => `${one.uid.slice(0, 8)}…`;

/** Text with the searched part marked. */
function Marked({ of }: { of: string }) {
  const part = matchOf(of, wanted.value);
  if (part === null) return <>{of}</>;
  return (
    <>
      {of.slice(0, part.from)}
      <mark class="found">{of.slice(part.from, part.to)}</mark>
      {of.slice(part.to)}
    </>
  );
}

function SmallDial({ of }: { of: InventoryServo }) {
  const here = live(of);
  const size = density.value === "compact" ? 32 : 44;
  return here ? <LiveDial one={here} size={size} /> : <Dial size={size} angle={null} stale label={NONE} />;
}

function AngleCell({ of }: { of: InventoryServo }) {
  const here = live(of);
  if (!here) return <span class="dim">{NONE}</span>;
  const present = angleNow(here);
  return <span class={present.stale ? "dim" : ""}>{angle(present.value)}</span>;
}

function RomCell({ of }: { of: InventoryServo }) {
  const here = live(of);
  const strings = words.servos;
  if (of.drift.length > 0)
    return (
      <span class="site-state">
        <Glyph kind="warning" size={14} /> {strings.drift}
      </span>
    );
  if (!here) return <span class="dim">{words.unknown}</span>;
  if (here.unsaved.length > 0)
    return (
      <span class="half k-intent">
        <Icon name="half" size={14} />
        {strings.ramOnly(here.unsaved.length)}
      </span>
    );
  return <span class="dim">{romKnown(here) ? strings.saved : words.unknown}</span>;
}

function ContactCell({ of }: { of: InventoryServo }) {
  const here = live(of);
  if (here) {
    const present = angleNow(here, now.value);
    return <>{present.age === null ? NONE : age(present.age)}</>;
  }
  return <>{of.last_seen === null ? words.servos.never : instant(of.last_seen)}</>;
}

export function SiteServos({ servos }: { servos: readonly InventoryServo[] }) {
  const strings = words.servos;
  const here = servos.filter(one => live(one) !== undefined);
  const attention = servos.filter(wants);
  const chosen = filter.value === "here" ? here : filter.value === "attention" ? attention : servos;
  const shown = chosen.filter(one => isSearched(one, wanted.value));
  return (
    <section aria-label={strings.title} data-density={density.value} class="site-servos">
      <div class="list-bar">
        <h2>{strings.title}</h2>
        <Search label={strings.search} at={wanted} />
        {wanted.value !== "" && (
          <span class="dim" role="status">
            {strings.found(shown.length, servos.length)}
          </span>
        )}
        <Segments<Filter>
          label={strings.filter}
          chosen={filter.value}
          onChoose={key => {
            filter.value = key;
          }}
          options={[
            { key: "all", label: strings.all },
            { key: "here", label: strings.here(here.length) },
            { key: "attention", label: strings.attention(attention.length) },
          ]}
        />
        <span class="grow" />
        <Segments<"list" | "compact">
          label={strings.view}
          chosen={density.value}
          onChoose={key => {
            density.value = key;
          }}
          options={[
            { key: "list", label: strings.list },
            { key: "compact", label: strings.compact },
          ]}
        />
      </div>
      <DataTable
        label={strings.title}
        rows={shown}
        id={one => one.uid}
        data={one => ({ testid: `site-${one.uid}`, away: live(one) === undefined })}
        order={order}
        columns={columns().filter(one => phone.value || !narrow.value || !WIDE.has(one.key))}
        empty={<p class="w-line second">{strings.none}</p>}
      />
    </section>
  );
}
