/** Table of the cursors: values, differences, and statistics of each curve between them. */
import { number, signed } from "../bench/format";
import { type Column, DataTable } from "../kit/data-table";
import { timeText } from "../plots/lanes";
import { valueAtTime } from "../plots/reading";
import type { TimeSpan } from "../plots/span";
import { telemetry } from "../telemetry/store";
import type { ScopeCurve } from "./acquire";
import { statisticsOf } from "./statistics";
import { scope as words } from "./words";

const FINE_S = 0.001;

export function CursorTable({ span, curves }: { span: TimeSpan; curves: readonly ScopeCurve[] }) {
  const [a, b] = span.cursors.value;
  const zero = span.still.value?.zero ?? 0;
  const time = (t: number | null) =>
    t === null ? "–" : timeText(Math.round((t - zero) / FINE_S) * FINE_S, 0.01);
  const both = a !== null && b !== null;
  const figures = curves.map(curve => figuresOf(curve, a, b));
  // The other figures are of the rest.
  const missing = figures.flatMap(({ of, curve }) =>
    of && of.missing > 0 ? [words.missing(String(of.missing), curve.letter)] : [],
  );
  return (
    <section aria-label={words.cursors}>
      <header>
        <h2>{words.cursors}</h2>
        {(a !== null || b !== null) && (
          <>
            <span class="small second" data-testid="scope-cursors">
              {words.cursorsAt(time(a), time(b))}
            </span>
            <span class="grow" />
            <button
              type="button"
              class="tool"
              onClick={() => {
                span.cursors.value = [null, null];
              }}
            >
              {words.clear}
            </button>
          </>
        )}
      </header>
      {a === null && b === null ? (
        <p class="small second">{words.cursorsHint}</p>
      ) : (
        <>
          {both && a !== b && (
            <p class="small second" data-testid="scope-delta">
              {words.between(timeText(Math.abs(b - a), 0.01), words.hz(number(1 / Math.abs(b - a), 2)))}
            </p>
          )}
          <DataTable
            small
            label={words.table}
            testid="scope-table"
            rows={figures}
            id={one => one.curve.letter}
            columns={columns()}
          />
          {missing.length > 0 && <p class="small second">{missing.join(" ")}</p>}
        </>
      )}
    </section>
  );
}

/** Values of a curve at the cursors, and statistics between them. */
function figuresOf(curve: ScopeCurve, a: number | null, b: number | null) {
  const samples = telemetry.ring(curve.uid, curve.channel).all();
  const [one, other] = [a, b].map(at => (at === null ? null : valueAtTime(samples, at)));
  const of = a !== null && b !== null ? statisticsOf(samples, a, b) : null;
  return { curve, one, other, of };
}

type Figures = ReturnType<typeof figuresOf>;

function columns(): Column<Figures>[] {
  const plain = (value: number | null | undefined, { decimals }: ScopeCurve) =>
    value == null ? "–" : number(value, decimals);
  const cells: Column<Figures>["cell"][] = [
    ({ curve }) => (
      <>
        <Letter curve={curve} /> <span class="small second">{curve.unit}</span>
      </>
    ),
    ({ one, curve }) => plain(one, curve),
    ({ other, curve }) => plain(other, curve),
    ({ one, other, curve }) => (one == null || other == null ? "–" : signed(other - one, curve.decimals)),
    ({ of, curve }) => plain(of?.mean, curve),
    ({ of, curve }) => (of ? number(of.sd, curve.decimals + 1) : "–"),
    ({ of, curve }) => <b>{plain(of?.peakToPeak, curve)}</b>,
  ];
  return cells.map((cell, at) => {
    const head = words.columns[at] ?? "";
    return { key: head, head, cell, right: at > 0, name: at === 0 };
  });
}

export function Letter({ curve }: { curve: ScopeCurve }) {
  const place = typeof curve.colour === "number" ? curve.colour % 8 : 0;
  return (
    <b class="scope-letter" style={{ borderColor: `var(--series-${place + 1})` }}>
      {curve.letter}
    </b>
  );
}
