/** The top bar: bus, load on a ruled scale, counts by health, motion control, and Stop at its end. */
import { useComputed } from "@preact/signals";
import { bus, type HeldLease, leases, stopped } from "../bench/bench";
import { channelOf, retryIn } from "../bench/bus-now";
import { now } from "../bench/clock";
import type { ConditionKind } from "../bench/condition";
import { all, nameOf, servo, uids } from "../bench/fleet";
import { number, withUnit } from "../bench/format";
import { isOurs, who } from "../bench/holder";
import { isOfOther, motion } from "../bench/motion";
import { commandedHere, commanderOf, elsewhere } from "../bench/role";
import { lastUid, pathOf } from "../bench/route";
import { phone, tightBar } from "../bench/screen";
import { conditionHere } from "../bench/servo-condition";
import { severalBenches, thisBench } from "../bench/site";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Mark } from "../kit/icon";
import { Panel } from "../kit/panel";
import { ruler } from "../kit/ruler";
import { text } from "../text";
import { StopButton } from "./stop-button";

export function TopBar() {
  return (
    <header class="bar">
      {/* First in DOM order for keyboard and screen readers; CSS sets its position. Outside the panel, so that it cannot fail with the rest. */}
      <StopButton />
      <div class="bar-rest">
        <div class="bar-mark">
          <Mark />
          <span>
            {text.name}
            {severalBenches.value && <small data-testid="bench-name">{thisBench.value?.name}</small>}
          </span>
        </div>
        <Panel>
          <BusCell />
          {!tightBar.value && <LoadCell />}
          <CountsCell />
          <MotionCell />
        </Panel>
        <div class="bar-fill" />
      </div>
    </header>
  );
}

const BUS = pathOf("bus", null);

function BusCell() {
  const state = bus.value;
  if (!state) return null;
  const name = channelOf(state.address);
  const load = state.load_pct === null ? null : withUnit(number(state.load_pct, 0), "%");
  const short = phone.value ? `${name} ${load ?? ""}` : text.bar.busLoad(name, load ?? "");
  const caption = tightBar.value && load !== null ? short : text.bar.bus(name);
  const rate =
    state.bitrate === null || tightBar.value
      ? ""
      : `${text.comma}${text.bar.bitrate(number(state.bitrate / 1e6, state.bitrate % 1e6 ? 2 : 0))}`;
  // A recording that has ended is no fault, but no more data follows.
  const over = state.state === "active" && state.trouble !== null;
  const well = state.state === "active" && !over;
  const nothing = state.trouble_code === "nothing_received";
  const word = over ? text.bar.over : nothing ? text.bar.nothing : text.bar.busState[state.state];
  const waits = retryIn.value;
  return (
    <a class="bar-cell" href={BUS} onClick={event => follow(event, BUS)} data-testid="bar-bus">
      <span class="cap">
        {caption}
        {state.role && !phone.value && (
          <span class="role-chip" data-testid="role">
            {text.bar.role[state.role]}
          </span>
        )}
      </span>
      <span class={`val ${well ? (phone.value ? "hidden-text" : "") : "strong k-warning"}`}>
        {waits === null || tightBar.value ? word : text.bar.retry(word, Math.ceil(waits))}
        {well && rate}
      </span>
    </a>
  );
}

const SCALE = 130;

function LoadCell() {
  const load = bus.value?.load_pct ?? null;
  // As guest the limit is that of our own frames, not of the load; an observer has none.
  const cap = bus.value?.role === "host" ? bus.value.load_cap_pct : null;
  if (!bus.value || bus.value.state === "disconnected") return null;
  const shown = load === null ? text.bar.loadUnknown : text.bar.load(withUnit(number(load, 0), "%"));
  const words =
    load !== null && cap !== null
      ? text.bar.loadLimit(withUnit(number(load, 0), "%"), withUnit(number(cap, 0), "%"))
      : shown;
  return (
    <a class="bar-cell" href={BUS} onClick={event => follow(event, BUS)}>
      <span class="cap">{words}</span>
      <svg class="ruled" width={SCALE + 2} height="16" viewBox={`-1 0 ${SCALE + 2} 16`} aria-hidden="true">
        <path
          d={ruler(SCALE, 20, 10.5, i => (i % 10 === 0 ? 3 : i % 5 === 0 ? 5 : 7))}
          stroke="var(--edge)"
          stroke-width="1"
          fill="none"
        />
        {load !== null && (
          <path d={`M0 13.5H${(SCALE * Math.min(100, load)) / 100}`} stroke="var(--ink)" stroke-width="4" />
        )}
        {cap !== null && <path d={`M${(SCALE * cap) / 100} 0V16`} stroke="var(--limit)" stroke-width="2" />}
      </svg>
    </a>
  );
}

const ORDER: readonly { kind: Exclude<ConditionKind, "protected">; worst: number }[] = [
  { kind: "ok", worst: 0 },
  { kind: "notice", worst: 2 },
  { kind: "busy", worst: 1 },
  { kind: "identifying", worst: 1 },
  { kind: "warning", worst: 4 },
  { kind: "failure", worst: 5 },
  { kind: "offline", worst: 3 },
];

function CountsCell() {
  const counts = useComputed(() => {
    const found = new Map<ConditionKind, number>();
    for (const one of all.value) {
      const kind = conditionHere(one).kind;
      const shown = kind === "protected" ? "warning" : kind;
      found.set(shown, (found.get(shown) ?? 0) + 1);
    }
    return found;
  }).value;
  const shown = ORDER.filter(one => counts.has(one.kind));
  const count = (kind: keyof typeof text.state.counts, worded: boolean) => {
    const words = text.state.counts[kind](counts.get(kind) ?? 0);
    return (
      <span key={kind} title={words}>
        <Glyph kind={kind} size={worded ? 16 : 12} />
        {worded ? words : counts.get(kind)}
        {!worded && <span class="hidden-text">{words}</span>}
      </span>
    );
  };
  // Narrow: only the two worst keep their words, on a phone none. The others are shape and count, beside the caption.
  const words = phone.value ? 0 : tightBar.value ? 2 : ORDER.length;
  const worded = new Set([...shown].sort((a, b) => b.worst - a.worst).slice(0, words));
  return (
    <div class="bar-cell">
      <span class="cap counts">
        <span class={phone.value ? "hidden-text" : ""}>{text.bar.servos}</span>
        {shown.map(one => !worded.has(one) && count(one.kind, false))}
      </span>
      <span class="val counts">
        {shown.length === 0 && text.bar.noServos}
        {shown.map(one => worded.has(one) && count(one.kind, true))}
      </span>
    </div>
  );
}

function MotionCell() {
  const uid = lastUid.value ?? uids.value[0];
  const path = pathOf("motion", uid ?? null);
  const valid = validLeases();
  const held = valid.find(one => one.request && isOurs(one)) ?? valid.find(one => one.request);
  const requested = held?.request ?? null;
  const left = Math.max(0, Math.ceil((held?.passesAt ?? now.value) - now.value));
  // On a phone it is shown only while it says something that no band says.
  if (phone.value && !requested && (stopped.value || shared() || motionWords() === text.bar.free))
    return null;
  // A phone has room for either.
  const named = phone.value && !requested && valid.length > 1;
  return (
    <a class="bar-cell" href={path} onClick={event => follow(event, path)} data-testid="bar-motion">
      <span class={named ? "cap hidden-text" : "cap"}>
        {requested ? text.bar.requested(who(requested.by), left) : motionCaption()}
      </span>
      <span class="val" title={motionWords()}>
        {motionWords()}
      </span>
    </a>
  );
}

function validLeases(): readonly HeldLease[] {
  return leases.value.filter(one => one.endsAt > now.value);
}

/** Seconds left for the only holder, another client. Our own are on the Motion page. */
function leftOfOther(): number | null {
  const [held, more] = validLeases();
  if (!held || more || stopped.value || !isOfOther(held)) return null;
  return Math.ceil(held.endsAt - now.value);
}

/** Narrow: the name below may need two lines, so the seconds go here. */
function motionCaption(): string {
  const left = leftOfOther();
  const below = tightBar.value || validLeases()[0]?.uids != null;
  return below && left !== null ? text.bar.motionLeft(left) : text.bar.motion;
}

/** Holders with the number of their servos: "Rig A: 3 servos, You: 2". */
function holders(valid: readonly HeldLease[]): string {
  return valid
    .map((one, i) => {
      const name = isOfOther(one) ? who(one.holder) : text.bar.you;
      return one.uids === null ? name : text.bar.share(name, one.uids.length, i > 0 || tightBar.value);
    })
    .join(text.comma);
}

/** Other nodes command servos, and no other client has motion control. */
function shared(): boolean {
  return elsewhere.value.length > 0 && !stopped.value && !validLeases().some(isOfOther);
}

function motionWords(): string {
  const mine = motion.value;
  if (shared()) {
    const nodes = [...new Set(elsewhere.value.flatMap(one => commanderOf(one)?.node_id ?? []))].join(
      text.comma,
    );
    return text.bar.elsewhere(nodes, elsewhere.value.length, commandedHere.value.length, tightBar.value);
  }
  const valid = stopped.value ? [] : validLeases();
  if (valid.length > 1) return holders(valid);
  if (mine.phase === "on") return tightBar.value ? text.bar.you : text.bar.youFor(nameOf(servo(mine.uid)));
  if (stopped.value) return text.bar.refused;
  const held = valid[0];
  if (!held) return text.bar.free;
  if (!isOfOther(held)) return text.bar.you;
  if (held.uids !== null) return holders(valid);
  return tightBar.value
    ? who(held.holder)
    : text.bar.held(who(held.holder), Math.ceil(held.endsAt - now.value));
}
