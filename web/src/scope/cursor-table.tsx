/** The cursors in figures: values, difference, and what each curve does between them. */
import { number, signed } from "../bench/format";
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
          <table class="scope-table" aria-label={words.table} data-testid="scope-table">
            <thead>
              <tr>
                {words.columns.map(one => (
                  <th key={one} scope="col">
                    {one}
                  </th>
                ))}
              </tr>
            </thead>
            <tbody>
              {curves.map(curve => (
                <Row key={curve.letter} {...{ curve, a, b }} />
              ))}
            </tbody>
          </table>
          {both && <Missing {...{ curves, a, b }} />}
        </>
      )}
    </section>
  );
}

/** What is missing between both cursors: the figures are of the rest. */
function Missing({ curves, a, b }: { curves: readonly ScopeCurve[]; a: number; b: number }) {
  const told = curves.flatMap(({ uid, channel, letter }) => {
    const missing = statisticsOf(telemetry.ring(uid, channel).all(), a, b)?.missing ?? 0;
    return missing > 0 ? [words.missing(String(missing), letter)] : [];
  });
  return told.length > 0 ? <p class="small second">{told.join(" ")}</p> : null;
}

function Row({ curve, a, b }: { curve: ScopeCurve; a: number | null; b: number | null }) {
  const samples = telemetry.ring(curve.uid, curve.channel).all();
  const [one, other] = [a, b].map(at => (at === null ? null : valueAtTime(samples, at)));
  const of = a !== null && b !== null ? statisticsOf(samples, a, b) : null;
  const digits = curve.decimals;
  const plain = (value: number | null | undefined) => (value == null ? "–" : number(value, digits));
  return (
    <tr>
      <th scope="row">
        <Letter curve={curve} /> <span class="small second">{curve.unit}</span>
      </th>
      <td>{plain(one)}</td>
      <td>{plain(other)}</td>
      <td>{one == null || other == null ? "–" : signed(other - one, digits)}</td>
      <td>{plain(of?.mean)}</td>
      <td>{of ? number(of.sd, digits + 1) : "–"}</td>
      <td>
        <b>{plain(of?.peakToPeak)}</b>
      </td>
    </tr>
  );
}

export function Letter({ curve }: { curve: ScopeCurve }) {
  const place = typeof curve.colour === "number" ? curve.colour % 8 : 0;
  return (
    <b class="scope-letter" style={{ borderColor: `var(--series-${place + 1})` }}>
      {curve.letter}
    </b>
  );
}
