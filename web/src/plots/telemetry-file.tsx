/** Files in the plot: a telemetry.csv from disk is drawn here; a recording is opened on the Recorder page. */

import { effect, useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { callApi, problemOf } from "../api/client";
import { catalog } from "../bench/catalog";
import { problemText } from "../bench/facts";
import { motion } from "../bench/motion";
import { go, pathOf } from "../bench/route";
import { FilePick } from "../kit/field";
import { Icon } from "../kit/icon";
import { fromCsv, type Recorded } from "../telemetry/csv";
import { TelemetryStore } from "../telemetry/store";
import { type Channel, channelsOf, curvesOf } from "./channels";
import { lanesOf } from "./lane";
import { PlotPanel } from "./panel";
import { isZip } from "./recording";
import { replayed, Scrub, tracksOf } from "./scrub";
import { ScrubBar } from "./scrub-bar";
import { TimeSpan } from "./span";
import { plots as words } from "./words";

export interface TelemetryFile {
  name: string;
  content: Recorded;
}

const CARRY_MS = 120_000;

export function TelemetryFilePick({ onOpen }: { onOpen: (found: TelemetryFile) => void }) {
  const problem = useSignal<string | null>(null);
  const carrying = useSignal<string | null>(null);
  const take = async (file: File) => {
    problem.value = null;
    if (!isZip(file.name)) {
      const content = fromCsv(await file.text());
      if (content) onOpen({ name: file.name, content });
      else problem.value = words.notRead(file.name);
      return;
    }
    carrying.value = file.name;
    try {
      const made = await callApi("PUT", "/recorder/recordings/{name}", {
        path: { name: file.name },
        file: { text: file, type: "application/zip" },
        timeout_ms: CARRY_MS,
      });
      go(pathOf("recorder", null, made.name));
    } catch (error) {
      problem.value = problemText(problemOf(error));
    } finally {
      carrying.value = null;
    }
  };
  return (
    <>
      {carrying.value !== null && <span class="small second">{words.carried(carrying.value)}</span>}
      {problem.value !== null && (
        <span class="small k-failure" role="alert" data-testid="plot-file-problem">
          {problem.value}
        </span>
      )}
      <FilePick
        look="tool"
        label={words.file}
        title={words.fileTitle}
        accept=".csv,.zip"
        testid="plot-file"
        onFile={file => void take(file)}
      >
        <Icon name="records" size={15} />
      </FilePick>
    </>
  );
}

/** A file drawn like live data: the same lanes, cursors and exports, from its own store. While it is open the
   3D view beside it shows it, unless the user switches to the servo. */
export function TelemetryFilePlot({ recording, onClose }: { recording: TelemetryFile; onClose: () => void }) {
  const rows = catalog.value?.rows;
  const inView = useSignal(true);
  const { store, span, lanes, scrub } = useMemo(() => {
    const known = new Map(channelsOf(rows?.values() ?? [], null).map(one => [one.key, one]));
    const setting = (key: string) => rows?.has(key) === true && !known.has(key);
    return drawn(recording.content, known, setting);
  }, [recording, rows]);
  useEffect(
    () =>
      effect(() => {
        span.head.value = scrub.at.value;
      }),
    [scrub],
  );
  const has = scrub.tracks.length > 0;
  const shown = has && inView.value;
  useEffect(() => {
    if (!shown) return undefined;
    replayed.value = scrub;
    return () => {
      replayed.value = null;
    };
  }, [scrub, shown]);
  return (
    <PlotPanel
      title={words.opened(recording.name)}
      note=""
      lanes={lanes}
      span={span}
      store={store}
      label={words.opened(recording.name)}
      file={recording.name.replace(/\.csv$/i, "")}
      testid="plot-recording"
      tools={
        <button type="button" class="tool plot-back" data-testid="plot-close-file" onClick={onClose}>
          {words.closeFile}
        </button>
      }
      foot={
        <ScrubBar
          scrub={scrub}
          note={!has ? words.scrub.noAngle : motion.value.phase === "off" ? null : words.scrub.motionOn}
        >
          {has && (
            <button
              type="button"
              class="tool"
              data-testid="scrub-view"
              aria-pressed={inView.value}
              onClick={() => {
                inView.value = !inView.peek();
              }}
            >
              {words.scrub.inView}
            </button>
          )}
        </ScrubBar>
      }
    />
  );
}

function drawn(content: Recorded, known: ReadonlyMap<string, Channel>, setting: (key: string) => boolean) {
  const store = new TelemetryStore();
  store.utcOffset = content.utcOffset;
  let from = Number.POSITIVE_INFINITY;
  let to = Number.NEGATIVE_INFINITY;
  const curves = content.columns.map((one, place) => {
    // "Elevator L/current_angle" if the file has several servos.
    const cut = one.head.lastIndexOf("/");
    const key = one.head.slice(cut + 1);
    const whose = cut < 0 ? "" : one.head.slice(0, cut);
    store.keep(whose, key, one.t, one.v);
    from = Math.min(from, one.t[0] ?? from);
    to = Math.max(to, one.t.at(-1) ?? to);
    // Settings are flat lines and are left out unless they changed.
    if (setting(key) && one.v.every(value => value === one.v[0])) return [];
    const channel = known.get(key) ?? { key, label: key.replaceAll("_", " "), unit: "", decimals: 2 };
    const [curve] = curvesOf(whose, [channel]);
    return curve && whose !== "" ? [{ ...curve, name: `${whose} ${channel.label}`, colour: place }] : [curve];
  });
  const most = { from, to: Math.max(to, from + 0.01), zero: from };
  const span = new TimeSpan(() => Number.NaN, most);
  const scrub = new Scrub(
    tracksOf(content.columns),
    { from, to: most.to, start: from, origin: from, utc: content.utcOffset },
    null,
    content.columns[0],
  );
  return { store, span, scrub, lanes: lanesOf(curves.flat().filter(one => one !== undefined)) };
}
