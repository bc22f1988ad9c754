/** The scope: channels of any servos on one time axis, with trigger, cursors, spectrum and ten minutes of memory. */
import { useSignal } from "@preact/signals";
import { useEffect, useLayoutEffect, useMemo, useRef } from "preact/hooks";
import type { TelemetryGrant } from "../api/types";
import { catalog } from "../bench/catalog";
import { monotonic, now } from "../bench/clock";
import { loaded, nameOf, servo, uids } from "../bench/fleet";
import { age, clock } from "../bench/format";
import { inTextBox } from "../bench/keys";
import { up } from "../bench/link";
import { subscribeTelemetry } from "../bench/telemetry-subscription";
import { Button } from "../kit/button";
import { Choice } from "../kit/field";
import { LoadingPage } from "../kit/loaded";
import { Note } from "../kit/note";
import { Segments } from "../kit/segments";
import { channelsOf } from "../plots/channels";
import { everyFrame } from "../plots/frames";
import { lanesOf } from "../plots/lane";
import { moveCursor, PlotLanes, timeText } from "../plots/lanes";
import { marksOf, watchMarks } from "../plots/marks";
import { savePicture, saveSamples } from "../plots/panel";
import { recallSamples } from "../plots/past";
import type { Plot } from "../plots/plot";
import { TimeSpan } from "../plots/span";
import { telemetry } from "../telemetry/store";
import { scope as words } from "./words";
import "../plots/plots.css";
import { idOf, letterOf, SCOPE_WINDOWS } from "./layout";
import { MemoryStrip } from "./memory";
import "./scope.css";
import { arm, checkTrigger, reset, type ScopeCurve } from "./acquire";
import { CursorTable } from "./cursor-table";
import { overlayCurve, type ScopeOverlay } from "./overlay";
import { OverlayMenu } from "./overlay-menu";
import { ScopeSide } from "./side";
import { SpectrumPanel } from "./spectrum-panel";
import { acquisition, channels, hidden, mode, rule, source } from "./state";
import { MODES, type Mode } from "./trigger";

const RATE_HZ = 50;
const CHECK_HZ = 10;
const MEMORY_S = 600;

export function ScopePage() {
  return loaded.value && catalog.value ? <Scope /> : <LoadingPage />;
}

function Scope() {
  const span = useMemo(() => new TimeSpan(() => telemetry.serverTime(monotonic())), []);
  const box = useRef<HTMLDivElement>(null);
  const plots = useRef<(Plot | null)[]>([]);
  const overlays = useSignal<readonly ScopeOverlay[]>([]);
  const problem = useSignal<string | null>(null);
  const chosen = channels.value;
  const wanted = chosen.map(idOf).join(" ");
  const curves = useCurves();
  const shown = curves.filter(one => !hidden.value.has(idOf(one)));
  const grants = useGrants(wanted);
  const waiting = acquisition.value.state === "waiting";
  const level = rule.value.level;
  const lanes = useMemo(() => {
    const laid = overlays.value.flatMap(one => shown.flatMap(curve => overlayCurve(one, curve, span) ?? []));
    return lanesOf([...shown, ...laid]).map(lane => {
      const labels = new Set(
        lane.curves.flatMap(one => shown.find(each => idOf(each) === idOf(one))?.label ?? []),
      );
      const title = [[...labels].join(", "), lane.unit].filter(Boolean).join(", ");
      const fires = lane.curves.some(one => idOf(one) === source.value);
      return { ...lane, title, ...(fires ? { level: { value: level, waiting } } : {}) };
    });
  }, [shown.map(one => idOf(one) + one.name).join(" "), overlays.value, source.value, level, waiting]);
  const shownUids = useMemo(() => new Set(chosen.map(one => one.uid)), [wanted]);
  const marks = useMemo(
    () => () => {
      const fired = acquisition.peek();
      const at = fired.state === "triggered" ? [{ t: fired.at, word: words.trigger }] : [];
      return [...marksOf(shownUids), ...at].sort((a, b) => a.t - b.t);
    },
    [shownUids],
  );
  useEffect(() => watchMarks(), []);
  const [first] = uids.value;
  // Default channels for an address that names none, before it is painted without any.
  useLayoutEffect(() => {
    if (first === undefined || channels.peek().length > 0) return;
    channels.value = ["current_angle", "command_angle"].map(channel => ({ uid: first, channel }));
  }, [first === undefined]);
  useEffect(() => {
    for (const uid of shownUids) {
      const keys = chosen.filter(one => one.uid === uid).map(one => one.channel);
      void recallSamples(uid, keys, MEMORY_S);
    }
  }, [wanted]);
  useEffect(
    () => (box.current ? everyFrame(box.current, CHECK_HZ, () => checkTrigger(span)) : undefined),
    [span],
  );
  useEffect(() => keysOf(span, box), [span]);
  const choose = (next: Mode) => {
    mode.value = next;
    acquisition.value = { state: "free" };
    if (next === "pause") span.pause();
    else span.follow();
  };
  const filed = { lanes, span, file: words.fileOf, label: words.label, store: telemetry };
  return (
    <div class="page scope" data-testid="scope-page">
      <div class="page-head scope-tools">
        <h1>{words.label}</h1>
        <span class="grow" />
        <Segments<Mode>
          label={words.mode}
          chosen={mode.value}
          onChoose={choose}
          options={MODES.map(key => ({ key, label: words.modes[key] }))}
        />
        <Choice
          bare
          short
          label={words.window}
          testid="scope-window"
          at={{
            get value() {
              return String(span.seconds.value);
            },
            set value(next: string) {
              acquisition.value = { state: "free" };
              span.choose(Number(next));
            },
          }}
          options={SCOPE_WINDOWS.map(one => ({ key: String(one), label: timeText(one, one < 1 ? 0.5 : 1) }))}
        />
        <OverlayMenu
          channels={chosen}
          onOverlay={one => {
            overlays.value = [...overlays.peek().filter(each => each.name !== one.name), one];
          }}
          onProblem={why => {
            problem.value = why;
          }}
        />
        <Button testid="scope-csv" onClick={() => saveSamples(filed)} disabled={lanes.length === 0}>
          CSV
        </Button>
        <Button
          testid="scope-png"
          onClick={() => void savePicture(plots.current, filed)}
          disabled={lanes.length === 0}
        >
          PNG
        </Button>
      </div>
      <div class="scope-split">
        <div class="scope-main" ref={box}>
          <div class="scope-status">
            <Status span={span} empty={chosen.length === 0} />
            <span class="grow" />
            {span.away && acquisition.value.state !== "triggered" ? (
              <button
                type="button"
                class="tool plot-back"
                data-testid="scope-live"
                onClick={() => choose("run")}
              >
                {words.reset}
              </button>
            ) : (
              <span class="small second touch-hide">{words.hint}</span>
            )}
          </div>
          <Note>{problem.value}</Note>
          {lanes.length > 0 && (
            // biome-ignore lint/a11y/noStaticElementInteractions: the button Back to live does the same
            <div class="scope-lanes" onDblClick={() => reset(span)}>
              <PlotLanes
                {...{ lanes, span, marks, plots }}
                store={telemetry}
                label={words.place}
                testid="scope-plot"
                cursors={["1", "2"]}
                hint={words.cursorsHint}
                ruled
              />
            </div>
          )}
          <SpectrumPanel span={span} curves={shown} />
          <MemoryStrip span={span} curves={shown} seconds={MEMORY_S} />
        </div>
        <ScopeSide {...{ span, curves, grants, overlays, requested: RATE_HZ, windowed: span.seconds.value }}>
          <CursorTable span={span} curves={shown} />
        </ScopeSide>
      </div>
    </div>
  );
}

/** The selected channels as curves: a command has the colour of the channel that follows it. */
function useCurves(): (ScopeCurve & { label: string })[] {
  const rows = catalog.value?.rows;
  const known = useMemo(
    () => new Map(channelsOf(rows?.values() ?? [], null).map(one => [one.key, one])),
    [rows],
  );
  const all = channels.value;
  const followed = (key: string) => key.replace("command_", "current_");
  const tinted = [...new Set(all.map(one => `${one.uid}/${followed(one.channel)}`))];
  return all.flatMap((one, place) => {
    const channel = known.get(one.channel);
    if (!channel || !uids.value.includes(one.uid)) return [];
    const letter = letterOf(place);
    return {
      ...one,
      letter,
      tag: letter,
      name: nameOf(servo(one.uid)),
      label: channel.label,
      unit: channel.unit,
      decimals: channel.decimals,
      colour: tinted.indexOf(`${one.uid}/${followed(one.channel)}`),
      dashed: one.channel.startsWith("command_"),
    };
  });
}

function useGrants(wanted: string): ReadonlyMap<string, TelemetryGrant> {
  const grants = useSignal<ReadonlyMap<string, TelemetryGrant>>(new Map());
  useEffect(() => {
    grants.value = new Map();
    const of = new Map<string, string[]>();
    for (const id of wanted.split(" ")) {
      const [uid, key] = id.split("/");
      if (uid && key) of.set(uid, [...(of.get(uid) ?? []), key]);
    }
    const ends = [...of].map(([uid, keys]) =>
      subscribeTelemetry(uid, keys, RATE_HZ, grant => {
        grants.value = new Map(grants.peek()).set(uid, grant);
      }),
    );
    return () => {
      for (const end of ends) end();
    };
  }, [wanted]);
  return grants.value;
}

function keysOf(span: TimeSpan, box: { current: HTMLElement | null }): () => void {
  const down = (event: KeyboardEvent) => {
    if (inTextBox(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "1" || event.key === "2") {
      const which = event.key === "1" ? 0 : 1;
      const first = channels.peek()[0];
      const at = span.cursors.peek()[which];
      if (at !== null) span.move(which, at);
      else if (first) moveCursor(span, telemetry, { ...first, name: "", colour: 0, dashed: false }, which, 0);
      box.current?.querySelector<HTMLElement>(".plot-lanes")?.focus();
      event.preventDefault();
    } else if (event.key.toLowerCase() === "t" && source.peek() !== null) arm(span);
  };
  document.addEventListener("keydown", down);
  return () => document.removeEventListener("keydown", down);
}

function Status({ span, empty }: { span: TimeSpan; empty: boolean }) {
  const strings = words.status;
  const state = acquisition.value;
  const at = (t: number) => clock(t + telemetry.utcOffset, true);
  const sentence = () => {
    if (!up.value) return strings.noLink;
    if (empty) return strings.empty;
    if (state.state === "waiting") {
      return strings.waiting(age(Math.max(0, telemetry.serverTime(now.value) - state.since), 0));
    }
    if (state.state === "filling") return strings.filling;
    if (state.state === "triggered")
      return (mode.value === "single" ? strings.single : strings.triggered)(at(state.at));
    return span.still.value ? strings.paused : strings.free;
  };
  return (
    <b role="status" data-testid="scope-status" data-state={state.state}>
      {sentence()}
    </b>
  );
}
