/** The plot of one servo: angle and command by default, any other channel, or a recording. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import type { TelemetryGrant } from "../api/types";
import { catalog } from "../bench/catalog";
import { monotonic } from "../bench/clock";
import { nameOf, servo } from "../bench/fleet";
import { number } from "../bench/format";
import { figureNow } from "../bench/fresh";
import { noteText } from "../bench/note-text";
import { sheetOf } from "../bench/parameters";
import { pathOf } from "../bench/route";
import { CHANNELS, RATE_HZ, subscribeTelemetry, watched } from "../bench/telemetry-subscription";
import { follow } from "../kit/follow";
import { telemetry } from "../telemetry/store";
import { channelsOf, curvesOf } from "./channels";
import { lanesOf } from "./lane";
import { PlotPanel } from "./panel";
import { PlotPicker } from "./picker";
import { TimeSpan } from "./span";
import { type TelemetryFile, TelemetryFilePick, TelemetryFilePlot } from "./telemetry-file";
import { plots as words } from "./words";

const FIRST = ["current_angle", "command_angle"];

export function AnglePlot({ uid }: { uid: string }) {
  const span = useMemo(() => new TimeSpan(() => telemetry.serverTime(monotonic())), [uid]);
  const chosen = useSignal<readonly string[]>(FIRST);
  const hz = useSignal(RATE_HZ);
  const open = useSignal(false);
  const recording = useSignal<TelemetryFile | null>(null);
  const grant = useSubscription(uid, chosen.value, hz.value);
  const one = servo(uid);
  const has = sheetOf(uid).keys.value;
  const known = catalog.value;
  const offered = useMemo(() => channelsOf(known?.rows.values() ?? [], has), [known, has]);
  const lanes = useMemo(() => {
    const drawn = offered.filter(channel => chosen.value.includes(channel.key));
    return lanesOf(curvesOf(uid, drawn));
  }, [uid, offered, chosen.value]);
  const quiet = grant !== null && figureNow(uid, "current_angle").stale;
  const name = nameOf(one);
  if (recording.value) {
    return (
      <TelemetryFilePlot
        recording={recording.value}
        onClose={() => {
          recording.value = null;
        }}
      />
    );
  }
  const scope = pathOf("scope", null, "", { ch: `${uid}:${chosen.value.join(",")}` });
  const nothing = grant !== null && grant.note !== null && grant.channels.length === 0;
  const title = lanes.flatMap(lane => lane.curves.map(curve => curve.name)).join(", ");
  const measured = lanes.flatMap(lane => lane.curves.filter(curve => !curve.dashed)).map(curve => curve.name);
  return (
    <PlotPanel
      title={measured.join(", ") || words.angle}
      note={nothing ? "" : rateOf(grant, quiet)}
      lanes={lanes}
      span={span}
      label={words.label(title || words.angle, name)}
      file={name}
      testid="plot-angle"
      tools={
        <>
          <button
            type="button"
            class="tool"
            data-testid="plot-channels"
            aria-expanded={open.value}
            onClick={() => {
              open.value = !open.value;
            }}
          >
            {words.channels}
          </button>
          <a
            class="tool"
            data-testid="plot-scope"
            title={words.scopeTitle}
            href={scope}
            onClick={event => follow(event, scope)}
          >
            {words.scope}
          </a>
        </>
      }
      {...(nothing
        ? {
            instead: (
              <p class="plot plot-note second" data-testid="plot-note">
                {noteOf(grant)}
              </p>
            ),
          }
        : {})}
    >
      {open.value && (
        <PlotPicker
          {...{ offered, name, chosen, hz }}
          file={
            <TelemetryFilePick
              onOpen={found => {
                recording.value = found;
                open.value = false;
              }}
            />
          }
        />
      )}
    </PlotPanel>
  );
}

function rateOf(grant: TelemetryGrant | null, quiet: boolean): string {
  if (grant?.note) return noteOf(grant);
  if (quiet) return words.noData;
  return grant ? words.rate(number(grant.granted_hz, 0), number(grant.requested_hz, 0)) : words.waiting;
}

/** The panel's own subscription suffices for most plots; a plot of more channels has its own one. */
function useSubscription(uid: string, channels: readonly string[], hz: number): TelemetryGrant | null {
  const own = useSignal<TelemetryGrant | null>(null);
  const more = hz !== RATE_HZ || channels.some(key => !CHANNELS.includes(key));
  const wanted = channels.join(" ");
  useEffect(() => {
    own.value = null;
    if (!more || wanted === "") return undefined;
    return subscribeTelemetry(uid, wanted.split(" "), hz, grant => {
      own.value = grant;
    });
  }, [uid, wanted, hz, more]);
  const usual = watched.value?.uid === uid ? watched.value : null;
  return more ? own.value : usual;
}

function noteOf(grant: TelemetryGrant): string {
  return noteText(grant.note ?? "", grant.note_code, grant.note_params);
}
