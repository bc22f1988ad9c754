/** The plot of several servos: one channel of each, a colour per servo, commands dashed in the same colour. */
import { useComputed, useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import type { TelemetryGrant } from "../api/types";
import { catalog } from "../bench/catalog";
import { monotonic } from "../bench/clock";
import { nameOf, servo } from "../bench/fleet";
import { number } from "../bench/format";
import { subscribeTelemetry } from "../bench/telemetry-subscription";
import { Tick } from "../kit/field";
import { channelsOf, type Drawn } from "../plots/channels";
import { keyOf, lanesOf } from "../plots/lane";
import { PlotPanel } from "../plots/panel";
import { TimeSpan } from "../plots/span";
import { plots as words } from "../plots/words";
import { telemetry } from "../telemetry/store";

/** Requested for each servo; the server grants what the bus allows. */
const RATE_HZ = 50;
const FIRST = "current_angle";

interface Props {
  uids: readonly string[];
}

export function ManyPlot({ uids }: Props) {
  const span = useMemo(() => new TimeSpan(() => telemetry.serverTime(monotonic())), []);
  const channel = useSignal(FIRST);
  const commands = useSignal(false);
  const known = catalog.value;
  const offered = useMemo(
    () => channelsOf(known?.rows.values() ?? [], null).filter(one => one.key.startsWith("current_")),
    [known],
  );
  const shown = offered.find(one => one.key === channel.value);
  const command = known?.rows.has(channel.value.replace("current_", "command_"))
    ? channel.value.replace("current_", "command_")
    : null;
  const channels = [channel.value, ...(commands.value && command ? [command] : [])].join(" ");
  const grants = useGrants(uids.join(" "), channels);
  const names = useComputed(() => uids.map(uid => nameOf(servo(uid))).join("\n")).value;
  const lanes = useMemo(() => {
    if (!shown) return [];
    const reported = names.split("\n");
    const curves = uids.flatMap<Drawn>((uid, place) =>
      channels.split(" ").map(key => ({
        uid,
        channel: key,
        name: reported[place] ?? "",
        colour: place,
        dashed: key !== channel.value,
        unit: shown.unit,
        decimals: shown.decimals,
      })),
    );
    return lanesOf(curves);
  }, [uids.join(" "), names, shown, channels]);
  if (uids.length === 0) return <p class="notice-line">{words.none}</p>;
  const label = words.label(shown?.label ?? words.angle, words.many(uids.length));
  const curves = lanes.flatMap(lane => lane.curves.filter(one => !one.dashed));
  return (
    <div class="many-plot" data-testid="many-plot">
      <PlotPanel
        title={shown?.label ?? words.angle}
        note={grants}
        lanes={lanes}
        span={span}
        label={label}
        file={words.many(uids.length)}
        testid="plot-many"
        tools={
          <>
            <label class="plot-window">
              <span class="hidden-text">{words.manyChannel}</span>
              <select
                data-testid="many-channel"
                value={channel.value}
                onChange={event => {
                  channel.value = event.currentTarget.value;
                }}
              >
                {offered.map(one => (
                  <option key={one.key} value={one.key}>
                    {one.label}
                  </option>
                ))}
              </select>
            </label>
            {command && (
              <Tick label={words.withCommand} at={commands} class="plot-pick" testid="many-commands" />
            )}
          </>
        }
      >
        <ul class="plot-legend" aria-label={words.curves}>
          {curves.map((one, place) => (
            <li key={one.uid}>
              <button
                type="button"
                class="tool"
                data-testid={`many-${one.uid}`}
                aria-pressed={span.lit.value === keyOf(one)}
                aria-label={words.light(one.name)}
                onClick={() => {
                  span.lit.value = span.lit.peek() === keyOf(one) ? null : keyOf(one);
                }}
              >
                <svg width="22" height="12" viewBox="-11 -6 22 12" aria-hidden="true">
                  <path d="M-11 0H11" stroke={`var(--series-${(place % 8) + 1})`} stroke-width="2" />
                </svg>
                {one.name}
              </button>
            </li>
          ))}
        </ul>
      </PlotPanel>
    </div>
  );
}

/** The requested rate, and the granted rate of the slowest servo in words. */
function useGrants(uids: string, channels: string): string {
  const grants = useSignal<ReadonlyMap<string, TelemetryGrant>>(new Map());
  useEffect(() => {
    grants.value = new Map();
    const ends = uids
      .split(" ")
      .filter(uid => uid !== "")
      .map(uid =>
        subscribeTelemetry(uid, channels.split(" "), RATE_HZ, grant => {
          grants.value = new Map(grants.peek()).set(uid, grant);
        }),
      );
    return () => {
      for (const end of ends) end();
    };
  }, [uids, channels]);
  const reported = [...grants.value.values()].map(one => one.granted_hz);
  return reported.length === 0
    ? words.waiting
    : words.rate(number(Math.min(...reported), 0), number(RATE_HZ, 0));
}
