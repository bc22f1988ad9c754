/** The Faults page: active and past faults of every servo with meaning and remedy, and their acknowledgement. */
import { useEffect } from "preact/hooks";
import { type ConditionKind, ROM_LOST } from "../bench/condition";
import { all, type KnownServo, loaded, nameOf, servo } from "../bench/fleet";
import { unbroken } from "../bench/format";
import { who } from "../bench/holder";
import { connection, up } from "../bench/link";
import { go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { type Column, DataTable, RowLink } from "../kit/data-table";
import { Choice, cell } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Guides } from "../kit/guide";
import { instant, Unread } from "../kit/loaded";
import { Scroll } from "../kit/scroll";
import { ToSnapshots } from "../servo/condition-lines";
import {
  acknowledge,
  faultsOf,
  type KnownFault,
  present,
  readFaults,
  readServos,
  troubleOf,
  unseen,
} from "../servo/faults";
import { HappenedLink } from "../servo/happened-link";
import { faults as words } from "./words";
import "./faults.css";

const KIND: Record<KnownFault["level"], ConditionKind> = {
  failure: "failure",
  warning: "warning",
  notification: "notice",
};

export function FaultsPage({ uid }: { uid: string | null }) {
  const servos = all.value;
  const chosen = uid === null ? servos : servos.filter(one => one.uid === uid);
  const uids = chosen.map(one => one.uid);
  const { now, past } = faultsOf(uids);
  const open = [...now, ...past].filter(unseen);
  const waiting = new Set(open.map(one => one.uid));
  const trouble = troubleOf(uids);
  const missing = uids.length === 0 ? !loaded.value : readServos.value === 0 && trouble === null;
  return (
    <div class={`${uid === null ? "page" : "servo-tab"} faults`} data-testid="faults-page">
      <div class="page-head">
        {uid === null ? <h1>{words.title}</h1> : <h2>{words.title}</h2>}
        <span class="second" data-testid="faults-summary" role="status">
          {words.summary(now.length, open.length)}
        </span>
        <span class="grow" />
        <Choice
          label={words.servo}
          beside
          class="faults-servo"
          testid="faults-servo"
          at={cell(uid ?? "", one => go(pathOf("faults", one || null)))}
          options={[
            { key: "", label: words.all },
            ...servos.map(one => ({ key: one.uid, label: nameOf(one) })),
          ]}
        />
        <Button
          testid="acknowledge-all"
          live
          disabled={waiting.size === 0}
          onClick={() => {
            for (const one of waiting) void acknowledge(one);
          }}
        >
          {words.ackAll}
        </Button>
      </div>
      {servos.map(one => (
        <Reader key={one.uid} one={one} />
      ))}
      <Scroll label={words.title} testid="faults-list">
        <Unread
          why={trouble}
          sentence={words.failed}
          onAgain={() => {
            for (const one of uids) readFaults(one);
          }}
        />
        {missing && <p class="notice-line">{words.loading}</p>}
        {!missing && now.length + past.length === 0 ? (
          <Empty known={uids.length} />
        ) : (
          !missing && (
            <>
              <Part title={words.now} lines={now} none={words.noneNow} testid="faults-now" />
              {past.length > 0 && (
                <Part title={words.past} lines={past} none={words.nonePast} testid="faults-past" />
              )}
              <p class="faults-foot second small">{words.acknowledgeText}</p>
            </>
          )
        )}
      </Scroll>
    </div>
  );
}

/** Reads the faults of one servo again whenever its summary changes. */
function Reader({ one }: { one: KnownServo }) {
  const { failure, warning, notification } = one.faults;
  useEffect(() => {
    readFaults(one.uid);
  }, [one.uid, connection.value, one.online, one.unacknowledged, failure, warning, notification]);
  return null;
}

function Empty({ known }: { known: number }) {
  return (
    <div class="faults-empty" data-testid="faults-empty">
      <h2>
        <Glyph kind="ok" size={18} /> {words.emptyTitle}
      </h2>
      <p>{words.emptyText}</p>
      <p class="second">{words.emptyLive(known, readServos.value)}</p>
      <Button onClick={() => go(pathOf("servos", null))}>{words.toServos}</Button>
      <Guides places={["faults"]} />
    </div>
  );
}

interface PartProps {
  title: string;
  lines: KnownFault[];
  none: string;
  testid: string;
}

function Part({ title, lines, none, testid }: PartProps) {
  return (
    <section class="faults-part" aria-label={title} data-testid={testid}>
      <h2>
        {title} {lines.length > 0 && <span class="second">{lines.length}</span>}
      </h2>
      <DataTable
        label={title}
        rows={lines}
        id={one => `${one.uid}/${one.key}`}
        data={one => ({
          testid: `fault-${one.key}`,
          uid: one.uid,
          level: one.level,
          active: one.active,
          stale: unknown(one),
          unseen: unseen(one),
        })}
        columns={columns()}
        empty={
          <p class="faults-none">
            <Glyph kind="ok" /> {none}
          </p>
        }
      />
    </section>
  );
}

const columns = (): readonly Column<KnownFault>[] => [
  {
    key: "what",
    head: words.title,
    by: one => one.label,
    look: () => "fault-what",
    cell: one => (
      <>
        <h3>
          <Glyph kind={KIND[one.level]} size={18} /> {one.label}
          <span class="small second">{words.level[one.level]}</span>
          <Chips one={one} />
        </h3>
        <p>
          {unbroken(one.advice)} {one.key === ROM_LOST && <ToSnapshots uid={one.uid} />}
        </p>
        <p class="small">
          <HappenedLink from={one.first_seen} to={one.last_seen} />
        </p>
      </>
    ),
  },
  {
    key: "servo",
    head: words.servo,
    by: one => nameOf(servo(one.uid)),
    cell: one => {
      const name = nameOf(servo(one.uid));
      return (
        <>
          <RowLink path={pathOf("overview", one.uid)} title={words.open(name)}>
            {name}
          </RowLink>
          <small>{servo(one.uid)?.model}</small>
        </>
      );
    },
  },
  {
    key: "last",
    head: words.last,
    by: one => -one.last_seen,
    cell: one => (
      <>
        {instant(one.last_seen)}
        <small>{words.count(one.count)}</small>
        {one.count > 1 && (
          <small>
            {words.first} {instant(one.first_seen)}
          </small>
        )}
      </>
    ),
  },
  {
    key: "seen",
    head: words.ack,
    bare: true,
    right: true,
    cell: one =>
      unseen(one) ? (
        <Button
          live
          testid={`acknowledge-${one.key}`}
          label={words.ackOf(one.label, nameOf(servo(one.uid)))}
          onClick={() => void acknowledge(one.uid, one.key)}
        >
          {words.ack}
        </Button>
      ) : (
        one.acknowledged_at != null && (
          <small>{words.seenBy(who(one.acknowledged_by ?? ""), instant(one.acknowledged_at))}</small>
        )
      ),
  },
];

/** Its present state is unknown: the servo is silent, or there is no link to hornbill. */
function unknown(one: KnownFault): boolean {
  return one.stale || (one.active && !up.value);
}

function Chips({ one }: { one: KnownFault }) {
  return (
    <>
      {one.latched && <Chip why={words.latchedWhy}>{words.latched}</Chip>}
      {one.past_event && present(one) && <Chip why={words.pastEventWhy}>{words.pastEvent}</Chip>}
      {unknown(one) && <Chip why={words.staleWhy}>{words.stale}</Chip>}
      {!present(one) && <span class="fault-over">{words.over}</span>}
    </>
  );
}

function Chip({ why, children }: { why: string; children: string }) {
  return (
    <span class="fault-chip" title={why}>
      {children}
    </span>
  );
}
