/** The numbers of step tests: a column a run, each time with its error, what differs, what they were measured under. */
import type { StepRun } from "../api/lab-types";
import type { Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { full, number, signed, withUnit } from "../bench/format";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { ms, Swatch } from "./plot";
import * as lab from "./step-runs";
import { tune as words } from "./words";

interface MetricsProps {
  runs: StepRun[];
  differences: Readonly<Record<string, Value[]>>;
  direction: lab.Direction;
}

export function Metrics({ runs: shown, differences, direction }: MetricsProps) {
  const said = words.metrics;
  const base = shown[0];
  const last = shown.at(-1);
  const several = shown.length > 1;
  const errors = shown.map(run => lab.sampleOf(run, direction));
  const errorBoth = (errors[0] ?? 0) + (errors.at(-1) ?? 0);
  const differ = lab.differing(differences);
  const warnings = lab.warned(shown);
  if (!base || !last) return null;
  const cell = (place: number) => (several && place === shown.length - 1 ? "right strong" : "right");
  return (
    <section class="tune-metrics" aria-label={said.title}>
      {warnings.map(({ letters, line }) => (
        <Note key={line} kind="warning" band testid="run-warning">
          {several && <b>{letters.join(", ")}: </b>}
          {line}
        </Note>
      ))}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be scrollable by keys alone */}
      <div class="tune-table" role="region" aria-label={said.title} tabIndex={0}>
        <table class="table" data-testid="step-metrics">
          <thead>
            <tr>
              <th scope="col">{said.metric}</th>
              {shown.map((run, place) => (
                <th scope="col" key={run.id} class="right">
                  <span class="tune-letter">
                    <Swatch place={place} alone={!several} />
                    <b>{lab.letter(place)}</b>
                  </span>
                </th>
              ))}
              {several && (
                <th scope="col" class="right">
                  {said.against(lab.letter(shown.length - 1), lab.letter(0))}
                </th>
              )}
            </tr>
          </thead>
          <tbody>
            {lab.METRICS.map(({ key, kind }) => {
              const figures = shown.map(run => lab.figure(run, direction, key));
              const difference = several
                ? lab.compared(figures[0] ?? null, figures.at(-1) ?? null, kind, errorBoth)
                : null;
              return (
                <tr key={key} data-testid={`metric-${key}`}>
                  <th scope="row">
                    {said.names[key]} <small>{under(key, last)}</small>
                  </th>
                  {figures.map((one, place) => (
                    <td key={shown[place]?.id} class={cell(place)}>
                      <FigureCell one={one} kind={kind} error={errors[place] ?? 0} />
                    </td>
                  ))}
                  {several && (
                    <td class={difference?.within ? "right second" : "right"}>
                      {difference ? delta(difference.delta, kind) : said.unknown}
                      {difference?.within && <small>{said.within}</small>}
                    </td>
                  )}
                </tr>
              );
            })}
            <tr data-testid="metric-hunting">
              <th scope="row">{said.hunting}</th>
              {shown.map((run, place) => {
                const found = lab.hunting(run, direction);
                const verdict = found?.hunting ?? "none";
                return (
                  <td key={run.id} class={cell(place)}>
                    {verdict !== "none" && <Glyph kind="warning" size={13} />} {said.verdict[verdict]}
                    {verdict !== "none" && found && (
                      <small>
                        {said.hertz(
                          found.hunting_hz === null ? said.unknown : number(found.hunting_hz, 1),
                          withUnit(number(found.hunting_rms_deg ?? 0, 2), "°"),
                        )}
                      </small>
                    )}
                  </td>
                );
              })}
              {several && <td />}
            </tr>
          </tbody>
          <tbody>
            <tr class="tune-part">
              <th scope="rowgroup" colSpan={shown.length + (several ? 2 : 1)}>
                {several && differ.length > 0 ? said.parameters : said.conditions}
                {several && differ.length === 0 && <span class="second plain">. {said.same}</span>}
              </th>
            </tr>
            {differ.map(key => {
              const row = catalog.value?.rows.get(key);
              return (
                <tr key={key} class="tune-differs" data-testid={`differs-${key}`}>
                  <th scope="row">
                    {row?.label ?? key} {row && <small>{row.name}</small>}
                  </th>
                  {(differences[key] ?? []).map((value, place) => (
                    <td
                      key={shown[place]?.id}
                      class={value !== differences[key]?.[0] ? "right strong k-intent" : "right"}
                    >
                      {row ? full(value, { ...row, perUnit: row.per_unit }) : String(value)}
                    </td>
                  ))}
                  {several && <td />}
                </tr>
              );
            })}
            {several && differ.length > 0 && (
              <tr class="tune-part">
                <th scope="rowgroup" colSpan={shown.length + 2}>
                  {said.conditions}
                </th>
              </tr>
            )}
            {conditions(shown).map(line => (
              <tr key={line.name}>
                <th scope="row">{line.name}</th>
                {line.values.map((value, place) => (
                  <td key={shown[place]?.id} class="right second tune-wrap">
                    {value}
                  </td>
                ))}
                {several && <td />}
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}

function conditions(shown: readonly StepRun[]): { name: string; values: string[] }[] {
  const said = words.metrics;
  const or = (value: number | null, decimals: number, unit: string) =>
    value === null ? said.unknown : withUnit(number(value, decimals), unit);
  return [
    { name: said.supply, values: shown.map(run => or(run.voltage_v, 1, "V")) },
    { name: said.board, values: shown.map(run => or(run.temperature_c, 0, "°C")) },
    { name: said.firmware, values: shown.map(run => run.firmware ?? said.unknown) },
    { name: said.rate, values: shown.map(run => number(run.achieved_hz, 0)) },
    { name: said.note, values: shown.map(run => run.note || said.unknown) },
  ];
}

function under(key: lab.MetricKey, run: StepRun): string {
  const said = words.metrics;
  if (key === "settling_s") return said.settlingBand(withUnit(number(run.band_deg, 1), "°"));
  if (key === "steady_state_error_deg") return said.errorMean;
  return key === "overshoot_pct" ? said.ofStep : "";
}

type Kind = (typeof lab.METRICS)[number]["kind"];

function FigureCell({ one, kind, error }: { one: lab.MetricFigure | null; kind: Kind; error: number }) {
  const said = words.metrics;
  if (one === null) return <span class="second">{kind === "time" ? said.never : said.unknown}</span>;
  return (
    <>
      {value(one.value, kind)}
      {kind === "time" && <small>{said.plusMinus(ms(error))}</small>}
      {one.of > 1 && (
        <small>
          {one.reached < one.of
            ? said.reached(one.reached, one.of)
            : said.spread(value(one.low, kind), value(one.high, kind), one.of)}
        </small>
      )}
    </>
  );
}

function value(one: number, kind: Kind): string {
  switch (kind) {
    case "time":
      return ms(one);
    case "percent":
      return withUnit(number(one, 1), "%");
    case "angle":
      return withUnit(signed(one, 2), "°");
    case "speed":
      return withUnit(number(one, 0), "rpm");
  }
}

function delta(one: number, kind: Kind): string {
  if (kind === "time") return withUnit(signed(one * 1000, 0), "ms");
  if (kind === "percent") return words.metrics.points(signed(one, 1));
  if (kind === "angle") return withUnit(signed(one, 2), "°");
  return withUnit(signed(one, 0), "rpm");
}
