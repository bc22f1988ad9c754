/** The chip of the cursors: where they are, what each curve was there, and the differences. */
import { number, signed, withUnit } from "../bench/format";
import type { TelemetryStore } from "../telemetry/store";
import { keyOf, type Lane } from "./lane";
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
  return (
    <div class="plot-cursors" data-testid="plot-cursors">
      <table aria-label={words.table}>
        <thead>
          <tr>
            <th scope="col">
              <span class="hidden-text">{words.column}</span>
            </th>
            {([0, 1] as const).map(which => (
              <th key={which} scope="col">
                <Handle {...{ lanes, store, span, which }} shown={time} />
              </th>
            ))}
            <th scope="col" data-testid="plot-delta-t">
              {both && (
                <>
                  <span class="dim">Δt</span> {words.seconds(signed(b - a, decimals))}
                </>
              )}
            </th>
          </tr>
        </thead>
        <tbody>
          {lanes.flatMap(lane =>
            lane.curves.map(curve => {
              const samples = store.ring(curve.uid, curve.channel).all();
              const [one, other] = [a, b].map(at => (at === null ? null : valueAtTime(samples, at)));
              const told = (value: number | null | undefined) =>
                value === null || value === undefined
                  ? "–"
                  : withUnit(number(value, lane.decimals), lane.unit);
              const known = one !== null && one !== undefined && other !== null && other !== undefined;
              return (
                <tr key={keyOf(curve)}>
                  <th scope="row">{curve.name}</th>
                  <td>{a !== null && told(one)}</td>
                  <td>{b !== null && told(other)}</td>
                  <td data-testid={`plot-delta-${curve.channel}`}>
                    {known && (
                      <>
                        <span class="dim">Δ</span> {withUnit(signed(other - one, lane.decimals), lane.unit)}
                      </>
                    )}
                  </td>
                </tr>
              );
            }),
          )}
        </tbody>
      </table>
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

/** A cursor as something arrow keys move: from sample to sample of the first curve. */
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
