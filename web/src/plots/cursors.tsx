/** The readout of the cursors: their times, values of each curve, and differences. */
import { number, signed, withUnit } from "../bench/format";
import { DataTable } from "../kit/data-table";
import type { TelemetryStore } from "../telemetry/store";
import { keyOf, type Lane, type LaneCurve } from "./lane";
import { moveCursor } from "./lanes";
import { valueAtTime } from "./reading";
import type { Cursor, TimeSpan } from "./span";
import { plots as words } from "./words";

const FINE_S = 10;

interface Props {
  lanes: readonly Lane[];
  store: TelemetryStore;
  span: TimeSpan;
}

export function PlotCursors({ lanes, store, span }: Props) {
  const [a, b] = span.cursors.value;
  const still = span.still.value;
  if (!still || (a === null && b === null)) return null;
  const decimals = still.to - still.from < FINE_S ? 3 : 2;
  const time = (t: number) => words.seconds(signed(t - still.zero, decimals));
  const both = a !== null && b !== null;
  const valueAt = ({ uid, channel }: LaneCurve, which: Cursor) => {
    const at = span.cursors.value[which];
    return at === null ? undefined : valueAtTime(store.ring(uid, channel).all(), at);
  };
  const valueText = (lane: Lane, value: number | null | undefined) =>
    value === undefined ? "" : value === null ? "–" : withUnit(number(value, lane.decimals), lane.unit);
  const delta = (figure: string, sign = "Δ") => (
    <>
      <span class="dim">{sign}</span> {figure}
    </>
  );
  return (
    <div class="plot-cursors" data-testid="plot-cursors">
      <DataTable
        small
        label={words.table}
        rows={lanes.flatMap(lane => lane.curves.map(curve => ({ lane, curve })))}
        id={({ curve }) => keyOf(curve)}
        columns={[
          { key: "name", head: words.column, bare: true, name: true, cell: ({ curve }) => curve.name },
          ...([0, 1] as const).map(which => ({
            key: words.letters[which],
            head: words.letters[which],
            headCell: <Handle {...{ lanes, store, span, which }} shown={time} />,
            right: true,
            cell: ({ lane, curve }: { lane: Lane; curve: LaneCurve }) =>
              valueText(lane, valueAt(curve, which)),
          })),
          {
            key: "delta",
            head: "Δ",
            headCell: (
              <span data-testid="plot-delta-t">
                {both && delta(words.seconds(signed(b - a, decimals)), "Δt")}
              </span>
            ),
            right: true,
            cell: ({ lane, curve }) => {
              const [one, other] = [valueAt(curve, 0), valueAt(curve, 1)];
              const known = one != null && other != null;
              return (
                <b data-testid={`plot-delta-${curve.channel}`}>
                  {known && delta(withUnit(signed(other - one, lane.decimals), lane.unit))}
                </b>
              );
            },
          },
        ]}
      />
      {both && (
        <button
          type="button"
          class="tool"
          data-testid="plot-zoom-cursors"
          onClick={() => span.zoomToCursors()}
        >
          {words.zoomTo}
        </button>
      )}
    </div>
  );
}

/** A cursor that arrow keys move from sample to sample of the first curve. */
function Handle({
  lanes,
  store,
  span,
  which,
  shown,
}: Props & { which: Cursor; shown: (t: number) => string }) {
  const at = span.cursors.value[which];
  const still = span.still.value;
  const first = lanes[0]?.curves[0];
  if (at === null || !still) return null;
  const keys = (event: KeyboardEvent) => {
    const ends: Readonly<Record<string, number>> = { Home: still.from, End: still.to };
    const end = ends[event.key];
    const sign = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
    if ((sign === 0 && end === undefined) || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    if (end !== undefined) span.move(which, end);
    else if (first) moveCursor(span, store, first, which, sign * (event.shiftKey ? 10 : 1));
  };
  return (
    <span
      class="plot-handle"
      role="slider"
      tabIndex={0}
      aria-label={words.cursor(words.letters[which])}
      aria-valuemin={Math.round((still.from - still.zero) * 1000) / 1000}
      aria-valuemax={Math.round((still.to - still.zero) * 1000) / 1000}
      aria-valuenow={Math.round((at - still.zero) * 1000) / 1000}
      aria-valuetext={shown(at)}
      data-testid={`plot-cursor-${words.letters[which]}`}
      onKeyDown={keys}
    >
      <b>{words.letters[which]}</b> {shown(at)}
    </span>
  );
}
