/** The doctor's findings: problems with evidence and remedy first, passed checks below. */
import type { Finding } from "../api/bus-types";
import { bus } from "../bench/bench";
import { now } from "../bench/clock";
import { connectOpen } from "../bench/connect-open";
import { doctor, findings } from "../bench/doctor";
import { nameOf, servo } from "../bench/fleet";
import { age, grouped } from "../bench/format";
import { up } from "../bench/link";
import { changeChoices, go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { findingText } from "./finding";
import { withWord } from "./frame-filter";
import { box } from "./monitor-state";
import { Remedy } from "./remedy";
import { busWords as words } from "./words";

const strings = words.doctor;

export function Doctor({ onCheck }: { onCheck: () => void }) {
  return (
    <section class="doctor" aria-label={strings.title} data-testid="doctor">
      <header class="part-head">
        <h2>{strings.title}</h2>
        <Checked />
        <span class="grow" />
        <Button live testid="doctor-again" onClick={onCheck}>
          {strings.again}
        </Button>
      </header>
      <Scroll label={strings.list}>
        <Findings list={findings.value} />
      </Scroll>
    </section>
  );
}

/** Findings older than this are marked: the page reads them every three seconds. */
const OLD_S = 10;

function Checked() {
  const at = doctor.readAt.value;
  const passed = at === null ? null : Math.max(0, now.value - at);
  const old = passed !== null && passed > OLD_S;
  return (
    <span class={`small ${old ? "strong" : "dim"}`} data-testid="doctor-checked">
      {passed === null ? strings.first : strings.checked(age(passed, 0))}
    </span>
  );
}

export function Findings({ list }: { list: readonly Finding[] }) {
  const old = !up.value;
  const complaints = list.filter(one => one.severity !== "ok").length;
  return (
    <>
      {doctor.problem.value !== null && <Note band>{strings.failed(doctor.problem.value)}</Note>}
      {list.length > 0 && complaints === 0 && (
        <Note kind="ok" band testid="doctor-well">
          {strings.well(grouped(list.length))}
        </Note>
      )}
      <ul class={old ? "findings old" : "findings"}>
        {list.map((one, place) => (
          <FindingRow key={`${one.code}/${one.node_ids}/${one.uids}/${place}`} one={one} />
        ))}
      </ul>
    </>
  );
}

function FindingRow({ one }: { one: Finding }) {
  const { title, evidence, remedy, command } = findingText(one);
  return (
    <li class="finding" data-severity={one.severity} data-code={one.code}>
      <Glyph kind={one.severity} />
      <div>
        <p class={one.severity === "ok" ? "f-name" : "f-name strong"}>
          <span class="hidden-text">{strings.severity[one.severity]}: </span>
          {title}
        </p>
        <p class="f-evidence">{evidence}</p>
        {remedy !== null && <Remedy text={remedy} command={command} />}
        {one.severity !== "ok" && <Links one={one} />}
      </div>
    </li>
  );
}

const AT_IDS = new Set(["second_allocator", "allocator_off", "allocation_refused", "allocation_stuck"]);
const AT_CONNECT = new Set(["no_bus", "interface_down", "adapter_failed", "adapter_lost", "bit_rate"]);
const MOST = 3;

/** Links from a finding to the servos, nodes and dialogs it concerns. */
function Links({ one }: { one: Finding }) {
  const servos = (one.uids ?? []).flatMap(uid => servo(uid) ?? []).slice(0, MOST);
  const nodes = (one.node_ids ?? []).slice(0, MOST);
  const ids = AT_IDS.has(one.code);
  // Without a bus the adapters are listed beside this.
  const connect = AT_CONNECT.has(one.code) && !connectOpen.value && bus.value?.state !== "disconnected";
  if (servos.length + nodes.length === 0 && !ids && !connect) return null;
  const filterNode = (id: number) => {
    box.value = withWord(box.peek(), "node", id);
    changeChoices({}, "monitor");
  };
  return (
    <p class="finding-links small">
      {connect && (
        <button type="button" class="link" onClick={() => (connectOpen.value = true)}>
          {strings.connect}
        </button>
      )}
      {ids && (
        <button type="button" class="link" onClick={() => changeChoices({}, "ids")}>
          {strings.ids}
        </button>
      )}
      {servos.map(each => (
        <button
          key={each.uid}
          type="button"
          class="link"
          onClick={() => go(pathOf("parameters", each.uid, "node_id"))}
        >
          {strings.servo(nameOf(each))}
        </button>
      ))}
      {nodes.map(id => (
        <button key={id} type="button" class="link" onClick={() => filterNode(id)}>
          {strings.nodes(String(id))}
        </button>
      ))}
    </p>
  );
}
