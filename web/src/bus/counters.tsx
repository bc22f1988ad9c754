/** The strip of the bus page: the load over the last minute, and the counters. */
import { useEffect, useRef } from "preact/hooks";
import type { Bus } from "../api/types";
import { allocations } from "../bench/allocations";
import { bus } from "../bench/bench";
import { history } from "../bench/bus-now";
import { monotonic, now } from "../bench/clock";
import { grouped, minute, NONE, number } from "../bench/format";
import { up } from "../bench/link";
import { LoadPlot } from "../plots/load";
import type { BusCounter } from "../telemetry/bus-history";
import { bus as words } from "../text/topics";

const said = words.counters;

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
  const canvas = useRef<HTMLCanvasElement>(null);
  const plot = useRef<LoadPlot | null>(null);
  const text = words.plot;
  useEffect(() => {
    if (!canvas.current) return undefined;
    const made = new LoadPlot(canvas.current, history, {
      limit: text.limit,
      now: text.now,
      seconds: before => text.before(number(before, 0)),
      percent: value => text.pct(number(value, 0)),
    });
    plot.current = made;
    return () => made.destroy();
  }, []);
  useEffect(() => {
    if (plot.current) plot.current.cap = cap;
  });
  return (
    <canvas ref={canvas} class="load-plot" role="img" aria-label={text.label} data-testid="bus-load-plot" />
  );
}

const NODE_IDS = 125;

function Counters({ state }: { state: Bus }) {
  const free = state.allocator?.free ?? null;
  const pinned = allocations.value?.filter(one => one.pinned).length ?? 0;
  // The clock ends a rise that nothing else would.
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
