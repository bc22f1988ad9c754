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

const strings = words.counters;
const LOAD_SPAN_S = 60;
const LOAD_HZ = 5;
/** Bus state arrives about once a second: samples further apart than this leave a gap. */
const GAP_S = 3.5;
const LEAST_PCT = 60;

export function BusStrip() {
  const state = bus.value;
  return (
    <div class={up.value ? "bus-strip" : "bus-strip old"}>
      <Load cap={state?.role === "host" ? state.load_cap_pct : null} />
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
    return utc === null ? null : strings.rising(minute(utc));
  };
  return (
    <dl class="counters" data-testid="bus-counters">
      <Counter
        name={strings.received}
        value={strings.perSecond(grouped(state.rx_fps))}
        note={strings.frames(grouped(state.rx_frames))}
      />
      <Counter
        name={strings.sent}
        value={strings.perSecond(grouped(state.tx_fps))}
        note={strings.frames(grouped(state.tx_frames))}
      />
      <Counter
        name={strings.errors}
        value={grouped(state.errors)}
        rising={since("errors")}
        note={state.error_frames > 0 ? strings.seen(grouped(state.error_frames)) : strings.none}
      />
      <Counter
        name={strings.busOff}
        value={grouped(state.bus_offs)}
        rising={since("bus_offs") ?? since("reopened")}
        note={state.reopened > 0 ? strings.reopened(grouped(state.reopened)) : strings.neverReopened}
      />
      <Counter
        name={strings.unacknowledged}
        value={grouped(state.unacknowledged)}
        rising={since("unacknowledged")}
        note={strings.ofFrames}
      />
      <Counter name={strings.ignored} value={grouped(state.ignored)} note={strings.kinds} />
      <Counter
        name={strings.ids}
        value={strings.idsOf(free === null ? NONE : grouped(NODE_IDS - free))}
        note={strings.pinned(grouped(pinned))}
      />
      <Counter
        name={strings.dropped}
        value={grouped(state.rx_dropped)}
        rising={since("rx_dropped")}
        note={strings.tooFast}
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
