/** The strip of the bus page: the load over the last minute, and the counters. */
import { useEffect, useRef } from "preact/hooks";
import type { Bus } from "../api/types";
import { allocations } from "../bench/allocations";
import { bus } from "../bench/bench";
import { history } from "../bench/bus-now";
import { monotonic, now } from "../bench/clock";
import { grouped, minute, NONE, number } from "../bench/format";
import { up } from "../bench/link";
import { Plot } from "../plots/plot";
import { TimeSpan } from "../plots/span";
import type { BusCounter } from "../telemetry/bus-history";
import { busWords as words } from "./words";

const said = words.counters;
const LOAD_SPAN_S = 60;
const LOAD_HZ = 5;
/** Bus state arrives about once a second: samples further apart than this leave a gap. */
const GAP_S = 3.5;
const LEAST_PCT = 60;

export function BusStrip() {
  const state = bus.value;
  return (
    <div class={up.value ? "bus-strip" : "bus-strip old"}>
      <Load cap={state?.load_cap_pct ?? null} />
      {state && <Counters state={state} />}
    </div>
  );
}

function Load({ cap }: { cap: number | null }) {
  const box = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  const text = words.plot;
  useEffect(() => {
    if (!box.current) return undefined;
    const span = new TimeSpan(monotonic);
    span.choose(LOAD_SPAN_S);
    const made = new Plot(box.current, {
      x: before => (before === 0 ? text.now : text.before(number(before, 0))),
      y: value => text.pct(number(value, 0)),
      span,
      hz: LOAD_HZ,
    });
    plot.current = made;
    return () => made.destroy();
  }, []);
  useEffect(() => {
    const samples = (from: number) => history.load.since(from);
    plot.current?.show({
      curves: [{ samples, colour: "ink", gaps: GAP_S, filled: true }],
      bands: cap === null ? [] : [{ low: cap, high: cap, label: text.limit }],
      range: drawn => [0, Math.min(100, Math.max(LEAST_PCT, Math.ceil(((drawn?.[1] ?? 0) + 5) / 20) * 20))],
    });
  }, [cap]);
  return <div ref={box} class="load-plot" role="img" aria-label={text.label} data-testid="bus-load-plot" />;
}

const NODE_IDS = 125;

function Counters({ state }: { state: Bus }) {
  const free = state.allocator?.free ?? null;
  const pinned = allocations.value?.filter(one => one.pinned).length ?? 0;
  // With the clock, a rise ends even when no further sample arrives.
  const at = Math.max(now.value, monotonic());
  const since = (key: BusCounter) => {
    const utc = history.risingSince(key, at);
    return utc === null ? null : said.rising(minute(utc));
  };
  return (
    <dl class="counters" data-testid="bus-counters">
      <Counter
        name={said.received}
        value={said.perSecond(grouped(state.rx_fps))}
        note={said.frames(grouped(state.rx_frames))}
      />
      <Counter
        name={said.sent}
        value={said.perSecond(grouped(state.tx_fps))}
        note={said.frames(grouped(state.tx_frames))}
      />
      <Counter
        name={said.errors}
        value={grouped(state.errors)}
        rising={since("errors")}
        note={state.error_frames > 0 ? said.seen(grouped(state.error_frames)) : said.none}
      />
      <Counter
        name={said.busOff}
        value={grouped(state.bus_offs)}
        rising={since("bus_offs") ?? since("reopened")}
        note={state.reopened > 0 ? said.reopened(grouped(state.reopened)) : said.neverReopened}
      />
      <Counter
        name={said.unacknowledged}
        value={grouped(state.unacknowledged)}
        rising={since("unacknowledged")}
        note={said.ofFrames}
      />
      <Counter name={said.ignored} value={grouped(state.ignored)} note={said.kinds} />
      <Counter
        name={said.ids}
        value={said.idsOf(free === null ? NONE : grouped(NODE_IDS - free))}
        note={said.pinned(grouped(pinned))}
      />
      <Counter
        name={said.dropped}
        value={grouped(state.rx_dropped)}
        rising={since("rx_dropped")}
        note={said.tooFast}
      />
    </dl>
  );
}

interface CounterProps {
  name: string;
  value: string;
  note: string;
  rising?: string | null;
}

function Counter({ name, value, note, rising = null }: CounterProps) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>
        {value}
        <small class={rising === null ? "" : "k-warning"}>{rising ?? note}</small>
      </dd>
    </div>
  );
}
