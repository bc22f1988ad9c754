/** What is known of a servo: last seconds, faults, unsaved values, last step test, snapshots, history. */
import { useEffect } from "preact/hooks";
import { callApi } from "../api/client";
import type { Comparison, Snapshot } from "../api/config-types";
import type { StepRun } from "../api/lab-types";
import { catalog } from "../bench/catalog";
import { now } from "../bench/clock";
import { angleOf, type KnownServo } from "../bench/fleet";
import { age, angle, clock, date, minute } from "../bench/format";
import { who } from "../bench/holder";
import { connection } from "../bench/link";
import { verdictText } from "../bench/note-text";
import { sheetOf } from "../bench/parameters";
import type { Resource } from "../bench/resource";
import { go, pathOf } from "../bench/route";
import { rowLabelOf, valueText } from "../bench/row-text";
import { openDrift } from "../change/requests";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { lazy } from "../kit/lazy";
import { Panel } from "../kit/panel";
import { useResource } from "../kit/resource";
import { auditWord, reasonText } from "../servo/audit-text";
import { faultsOf, type KnownFault, present, readFaults } from "../servo/faults";
import { text } from "../text";
import { Card, Fact, Trouble } from "./card";
import { Notes } from "./notes";
import { taken, written } from "./state";
import { overview as words } from "./words";

const FailsafeFacts = lazy<{ one: KnownServo }>(() =>
  import("../autopilot/failsafe").then(file => file.FailsafeFacts),
);
const AnglePlot = lazy<{ uid: string }>(() => import("../plots/angle-plot").then(file => file.AnglePlot));

/** More entries than this are only counted; the link leads to the rest. */
const SHOWN = 3;

/** Other pages and programs also run tests, take snapshots, apply profiles and write. */
const POLL_MS = 3000;

export function Know({ one }: { one: KnownServo }) {
  const snapshots = useResource(() => callApi("GET", "/servos/{uid}/snapshots", { path: { uid: one.uid } }), {
    again: `${taken.value?.at} ${one.unsaved.length} ${one.state}`,
    of: one.uid,
    every_ms: POLL_MS,
  });
  return (
    <div class="o-know">
      <Panel>
        <div class="o-plot">
          <AnglePlot uid={one.uid} />
        </div>
      </Panel>
      <Panel>
        <Faults one={one} />
        <Unsaved one={one} />
      </Panel>
      <Panel>
        <LastRun one={one} />
        <FollowedProfile one={one} snapshots={snapshots} />
      </Panel>
      <Panel>
        <Snapshots one={one} list={snapshots} />
        <Notes uid={one.uid} />
      </Panel>
      <Panel>
        <Card
          title={words.failsafe}
          path={pathOf("parameters", one.uid, "timeout_action")}
          link={words.parameters}
          wide
          testid="card-failsafe"
        >
          <FailsafeFacts one={one} />
        </Card>
      </Panel>
      <Panel>
        <History one={one} />
      </Panel>
    </div>
  );
}

function Faults({ one }: { one: KnownServo }) {
  const { failure, warning, notification } = one.faults;
  useEffect(() => {
    readFaults(one.uid);
  }, [one.uid, connection.value, one.online, one.unacknowledged, failure, warning, notification]);
  const found = faultsOf([one.uid]);
  const received = angleOf(one, now.value).age;
  const past = found.past.slice(0, Math.max(1, SHOWN - 1 - found.now.length));
  const left = found.now.length + found.past.length - past.length - Math.min(found.now.length, SHOWN);
  return (
    <Card title={words.faults} path={pathOf("faults", one.uid)} link={words.allFaults} testid="card-faults">
      {found.now.length === 0 && (
        <Fact
          glyph={<Glyph kind={one.online ? "ok" : "offline"} />}
          line={received === null ? undefined : words.checked(age(received, one.online ? 1 : 0))}
        >
          {words.noneNow}
        </Fact>
      )}
      {found.now.slice(0, SHOWN).map(fault => (
        <FaultLine key={fault.key} one={fault} says={words.now} />
      ))}
      {past.map(fault => (
        <FaultLine key={fault.key} one={fault} says={words.pastAt} />
      ))}
      {left > 0 && <p class="second small">{words.more(left)}</p>}
    </Card>
  );
}

const KIND = { failure: "failure", warning: "warning", notification: "notice" } as const;

function FaultLine({ one, says }: { one: KnownFault; says: (what: string) => string }) {
  return (
    <Fact
      glyph={<Glyph kind={KIND[one.level]} />}
      line={present(one) ? `${instant(one.last_seen)}. ${one.advice}` : instant(one.last_seen)}
    >
      {says(one.label)}
    </Fact>
  );
}

function Unsaved({ one }: { one: KnownServo }) {
  const sheet = sheetOf(one.uid);
  const drift = one.drift ?? [];
  const rows = one.unsaved.flatMap(key => catalog.value?.rows.get(key) ?? []);
  return (
    <Card
      title={words.unsaved}
      path={pathOf("parameters", one.uid, "", rows.length > 0 ? { filter: "changed" } : {})}
      link={words.parameters}
      testid="card-unsaved"
    >
      {drift.length > 0 && (
        <Fact glyph={<Glyph kind="warning" />}>
          {text.servos.changedRows(drift.length)}{" "}
          <button type="button" class="link" data-testid="card-drift" onClick={() => openDrift(one.uid)}>
            {text.servos.showChanged}
          </button>
        </Fact>
      )}
      {rows.length === 0 && drift.length > 0 ? null : rows.length === 0 ? (
        <Fact glyph={<Icon name="tick" size={16} />}>{words.allSaved}</Fact>
      ) : (
        <table class="o-unsaved">
          <thead>
            <tr>
              <td />
              <th scope="col">{words.ram}</th>
              <th scope="col">{words.rom}</th>
            </tr>
          </thead>
          <tbody>
            {rows.slice(0, SHOWN).map(row => {
              const reading = sheet.reading(row.key).value;
              return (
                <tr key={row.key}>
                  <th scope="row">{row.label}</th>
                  <td class="strong">{valueText(row.key, reading?.value, reading?.unit)}</td>
                  <td class="second">{valueText(row.key, reading?.rom, reading?.unit)}</td>
                </tr>
              );
            })}
          </tbody>
        </table>
      )}
      {rows.length > SHOWN && <p class="second small">{words.more(rows.length - SHOWN)}</p>}
    </Card>
  );
}

function LastRun({ one }: { one: KnownServo }) {
  const list = useResource(() => callApi("GET", "/runs", { query: { uid: one.uid, limit: 1 } }), {
    of: one.uid,
    every_ms: POLL_MS,
  });
  const run = list.value.value?.[0];
  return (
    <Card title={words.run} path={pathOf("tune", one.uid)} link={words.toTune} testid="card-run" of={list}>
      {run ? (
        <RunFact run={run} />
      ) : (
        <>
          <Fact glyph={<Icon name="tune" size={16} />} line={words.noRunLine}>
            {words.noRun}
          </Fact>
          <Button onClick={() => go(pathOf("tune", one.uid))}>{words.runStep}</Button>
        </>
      )}
    </Card>
  );
}

function RunFact({ run }: { run: StepRun }) {
  return (
    <Fact glyph={<Glyph kind={run.verdict.level} />} line={words.step(angle(run.step_deg), instant(run.at))}>
      <b>{verdictText(run.verdict)}</b>
    </Fact>
  );
}

function Snapshots({ one, list }: { one: KnownServo; list: Resource<Snapshot[]> }) {
  const found = list.value.value ?? [];
  return (
    <Card
      title={words.snapshots}
      path={pathOf("records", null, `snapshots/${one.uid}`)}
      link={words.toSnapshots}
      testid="card-snapshots"
      of={list}
    >
      {found.length === 0 && (
        <Fact glyph={<Icon name="records" size={16} />} line={words.noSnapshotLine}>
          {words.noSnapshot}
        </Fact>
      )}
      {found.slice(0, SHOWN - 1).map(each => (
        <Fact
          key={each.id}
          glyph={<Icon name="records" size={16} />}
          line={`${instant(each.at)}, ${who(each.by)}`}
        >
          {reasonText(each.reason, each.reason_code, each.reason_params)}
        </Fact>
      ))}
      {found.length > SHOWN - 1 && <p class="second small">{words.more(found.length - SHOWN + 1)}</p>}
    </Card>
  );
}

/** The last applied profile: named by the snapshot taken before it. */
function FollowedProfile({ one, snapshots }: { one: KnownServo; snapshots: Resource<Snapshot[]> }) {
  const last = snapshots.value.value?.find(each => each.reason_code === "profile");
  const name = last ? String(last.reason_params.profile ?? "") : "";
  const compared = useResource<Comparison | null>(
    async () =>
      name === ""
        ? null
        : callApi("GET", "/compare", { query: { left: `servo:${one.uid}`, right: `profile:${name}` } }),
    { again: `${name} ${one.unsaved.length} ${one.state}`, of: one.uid, every_ms: POLL_MS },
  );
  const found = compared.value.value;
  // Rows outside the profile belong to the servo.
  const differ = found?.differences.filter(each => each.right_has).length ?? 0;
  return (
    <Card
      title={words.profileTitle}
      path={pathOf("records", null, "profiles")}
      link={words.toProfiles}
      testid="card-profile"
      of={snapshots}
    >
      {!last && (
        <Fact glyph={<Icon name="parameters" size={16} />} line={words.noProfileLine}>
          {words.noProfile}
        </Fact>
      )}
      {last && (
        <Fact
          glyph={<Icon name="parameters" size={16} />}
          line={words.applied(`${instant(last.at)}, ${who(last.by)}`)}
        >
          {words.follows(name)}
        </Fact>
      )}
      {found && (
        <Fact glyph={<Glyph kind={differ === 0 ? "ok" : "notice"} />}>
          {words.differ(differ, found.same)}
        </Fact>
      )}
      <Trouble of={compared} />
    </Card>
  );
}

const HISTORY = 4;

function History({ one }: { one: KnownServo }) {
  const list = useResource(() => callApi("GET", "/audit", { query: { uid: one.uid, limit: HISTORY } }), {
    again: `${one.unsaved.length} ${one.state} ${one.label} ${taken.value?.at} ${written.value}`,
    of: one.uid,
    every_ms: POLL_MS,
  });
  const found = list.value.value;
  return (
    <Card
      title={words.history}
      path={pathOf("records", null, "audit", { servo: one.uid })}
      link={words.allHistory}
      wide
      testid="card-history"
      of={list}
    >
      {found?.length === 0 && <p class="second">{words.noHistory}</p>}
      <table class="o-history">
        <tbody>
          {found?.map(row => (
            <tr key={row.id}>
              <td class="second">{instant(row.at)}</td>
              <td>
                {auditWord(row.action)}
                {row.key && `: ${rowLabelOf(row.key)}`}
                {row.key && row.after != null && ` ${valueText(row.key, row.after)}`}
                <span class="second">, {auditWord(row.outcome)}</span>
              </td>
              <td class="second right">{who(row.by)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </Card>
  );
}

/** "14:02:31" of today, "2026-03-01 14:02" of another day. */
function instant(utc: number): string {
  const day = date(utc);
  return day === date(Date.now() / 1000) ? clock(utc) : `${day} ${minute(utc)}`;
}
