/** The monitor: filter box, counts, pause, the list, and the details of one row. */
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { bus, connected } from "../bench/bench";
import { now } from "../bench/clock";
import { age, grouped, number } from "../bench/format";
import { onKey } from "../bench/keys";
import { up } from "../bench/link";
import { keepInAddress } from "../bench/route";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Segments } from "../kit/segments";
import { FrameDetail } from "./frame-detail";
import { withProblems } from "./frame-filter";
import { FrameList } from "./frame-list";
import { frameLineOf } from "./frame-text";
import * as monitor from "./monitor-state";
import { busWords as words } from "./words";

const strings = words.monitor;

export function Monitor() {
  useEffect(() => monitor.watchFrames(), []);
  useEffect(() => keepInAddress("q", monitor.box), []);
  return (
    <section class="monitor" aria-label={strings.title} data-testid="monitor">
      <Tools />
      <StatusLine />
      <Head />
      <div class="frames-box">
        <List />
        <Nothing />
      </div>
      <FrameDetail />
    </section>
  );
}

function Tools() {
  const filter = useRef<HTMLInputElement>(null);
  // Before the first paint, so that the key works as soon as the box is visible.
  useLayoutEffect(() => onKey("/", () => filter.current?.focus()), []);
  const problems = /(^|\s)problems(\s|$)/i.test(monitor.box.value);
  const held = monitor.heldSince.value !== null;
  return (
    <div class="monitor-tools">
      <label class="search" data-wrong={monitor.filterProblem.value !== null}>
        <Icon name="search" size={16} />
        <span class="hidden-text">{strings.filter}</span>
        <input
          ref={filter}
          type="search"
          data-testid="monitor-filter"
          placeholder={strings.example}
          autocomplete="off"
          spellcheck={false}
          value={monitor.box.value}
          aria-invalid={monitor.filterProblem.value !== null}
          aria-describedby="monitor-line"
          onInput={event => {
            monitor.box.value = event.currentTarget.value;
          }}
        />
        <kbd class="touch-hide">/</kbd>
      </label>
      <Segments
        label={strings.view}
        chosen={monitor.view.value}
        onChoose={key => {
          monitor.view.value = key;
        }}
        options={[
          { key: "decoded", label: strings.decoded },
          { key: "raw", label: strings.frames },
        ]}
      />
      <button
        type="button"
        class="button toggle"
        aria-pressed={problems}
        onClick={() => {
          monitor.box.value = withProblems(monitor.box.peek(), !problems);
        }}
      >
        {strings.problems}
      </button>
      <Button
        testid="monitor-pause"
        pressed={held}
        onClick={() => {
          if (held) monitor.followFrames();
          else monitor.paused.value = true;
        }}
      >
        <Icon name={held ? "play" : "pause"} size={15} />
        {held ? strings.resume : strings.pause}
      </Button>
    </div>
  );
}

/** One line under the tools: counts, and the error in the filter, if any. */
function StatusLine() {
  const problem = monitor.filterProblem.value ?? monitor.monitorRefusal.value;
  const counts = monitor.counts.value;
  const since = monitor.heldSince.value;
  return (
    <p class="monitor-line small" id="monitor-line">
      <span class="second" data-testid="monitor-counts">
        {strings.counts(grouped(counts.received), grouped(counts.shown), "")}
        <span class={counts.lost > 0 ? "k-warning strong" : ""}>{grouped(counts.lost)}</span>
      </span>
      {since !== null && (
        <span class="k-intent" data-testid="monitor-held">
          {strings.held(age(Math.max(0, now.value - since), 0), grouped(monitor.missed.value))}
        </span>
      )}
      {problem !== null && (
        <span class="refusal" role="alert" data-testid="filter-problem">
          <Glyph kind="failure" size={14} /> {problem}
        </span>
      )}
    </p>
  );
}

function Head() {
  const head = strings.head;
  return (
    <div class="f-head" aria-hidden="true">
      <span class="f-time">{head.time}</span>
      <span class="f-direction">{head.direction}</span>
      <span class="f-route">{head.route}</span>
      <span class="f-body">{monitor.view.value === "raw" ? head.data : head.transfer}</span>
      <span class="f-last">{head.id}</span>
    </div>
  );
}

function List() {
  const scroller = useRef<HTMLDivElement>(null);
  const list = useRef<FrameList | null>(null);
  useEffect(() => {
    if (!scroller.current) return undefined;
    const made = new FrameList(scroller.current, monitor.feed, {
      lineOf: row => frameLineOf(row, monitor.view.peek() === "raw"),
      onHold: () => {
        monitor.scrolled.value = true;
      },
      onEnd: () => {
        monitor.scrolled.value = false;
      },
      onChoose: number => {
        monitor.chosenFrame.value = number;
      },
    });
    list.current = made;
    return () => made.destroy();
  }, []);
  const chosen = monitor.chosenFrame.value;
  // Before the list is measured: the details make it shorter, and it then keeps the selected row in view.
  useLayoutEffect(() => list.current?.choose(chosen), [chosen]);
  return (
    <div
      ref={scroller}
      class="frames"
      role="grid"
      aria-label={strings.list}
      tabIndex={0}
      data-testid="frames"
      data-old={!up.value}
    />
  );
}

/** Time to wait for the first rows before the list is called empty. */
const FIRST_ROWS_S = 1;

function Nothing() {
  const counts = monitor.counts.value;
  if (counts.shown > 0 || monitor.heldSince.value !== null) return null;
  if (up.value && now.value - monitor.subscribedAt.value < FIRST_ROWS_S) return null;
  const state = bus.value;
  const filtered = monitor.box.value.trim() !== "";
  return (
    <div class="frames-empty" data-testid="monitor-empty">
      <p class="strong">
        {!up.value
          ? strings.noLink
          : !connected.value
            ? strings.noBus
            : filtered && counts.received > 0
              ? strings.nothingPasses(grouped(counts.received))
              : strings.nothing}
      </p>
      {up.value && connected.value && state && (
        <p class="second">{strings.quiet(number(state.rx_fps + state.tx_fps, 0), grouped(state.errors))}</p>
      )}
      <p class="second">{strings.filterHelp}</p>
      {filtered && (
        <Button
          onClick={() => {
            monitor.box.value = "";
          }}
        >
          {strings.clear}
        </Button>
      )}
    </div>
  );
}
