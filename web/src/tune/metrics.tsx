/** Results of step tests: one column per run with errors, parameter differences, and conditions. */
import type { ComponentChildren } from "preact";
import type { StepRun } from "../api/lab-types";
import type { Value } from "../api/types";
import { catalog } from "../bench/catalog";
import { full, number, signed, withUnit } from "../bench/format";
import { type Column, DataTable } from "../kit/data-table";
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
  const strings = words.metrics;
  const base = shown[0];
  const last = shown.at(-1);
  const several = shown.length > 1;
  const errors = shown.map(run => lab.sampleOf(run, direction));
  const errorBoth = (errors[0] ?? 0) + (errors.at(-1) ?? 0);
  const differ = lab.differing(differences);
  const warnings = lab.warned(shown);
  if (!base || !last) return null;
  const columns: Column<Line>[] = [
    {
      key: "metric",
      head: strings.metric,
      name: true,
      cell: line => (
        <>
          {line.name} {line.note && <small>{line.note}</small>}
        </>
      ),
    },
    ...shown.map((run, place) => ({
      key: String(run.id),
      head: lab.letter(place),
      headCell: (
        <span class="tune-letter">
          <Swatch place={place} alone={!several} />
          <b>{lab.letter(place)}</b>
        </span>
      ),
      right: true,
      look: (line: Line) => line.look?.(place) ?? "",
      cell: (line: Line) => line.cells[place],
    })),
  ];
  if (several)
    columns.push({
      key: "difference",
      head: strings.against(lab.letter(shown.length - 1), lab.letter(0)),
      right: true,
      look: line => (line.within ? "second" : ""),
      cell: line => (
        <>
          {line.difference}
          {line.within && <small>{strings.within}</small>}
        </>
      ),
    });
  const newest = (place: number) => (several && place === shown.length - 1 ? "strong" : "");
  const lines: Line[] = [
    ...lab.METRICS.map(({ key, kind }) => {
      const figures = shown.map(run => lab.figure(run, direction, key));
      const found = several
        ? lab.compared(figures[0] ?? null, figures.at(-1) ?? null, kind, errorBoth)
        : null;
      return {
        testid: `metric-${key}`,
        name: strings.names[key] ?? key,
        note: under(key, last),
        look: newest,
        cells: figures.map((one, place) => (
          <FigureCell key={place} one={one} kind={kind} error={errors[place] ?? 0} />
        )),
        difference: found ? delta(found.delta, kind) : strings.unknown,
        within: found?.within ?? false,
      };
    }),
    {
      testid: "metric-hunting",
      name: strings.hunting,
      look: newest,
      cells: shown.map(run => <Hunting key={run.id} found={lab.hunting(run, direction)} />),
    },
    ...differ.map((key, place) => {
      const row = catalog.value?.rows.get(key);
      const values = differences[key] ?? [];
      return {
        testid: `differs-${key}`,
        part: place === 0 && strings.parameters,
        differs: true,
        name: row?.label ?? key,
        note: row?.name ?? "",
        look: (at: number) => (values[at] !== values[0] ? "strong k-intent" : ""),
        cells: values.map(one => (row ? full(one, { ...row, perUnit: row.per_unit }) : String(one))),
      };
    }),
    ...conditions(shown).map(({ name, values }, place) => ({
      testid: `condition-${place}`,
      part: place === 0 && (
        <>
          {strings.conditions}
          {several && differ.length === 0 && <span class="second">. {strings.same}</span>}
        </>
      ),
      name,
      look: () => "second tune-wrap",
      cells: values,
    })),
  ];
  return (
    <section class="tune-metrics" aria-label={strings.title}>
      {warnings.map(({ letters, line }) => (
        <Note key={line} kind="warning" band testid="run-warning">
          {several && <b>{letters.join(", ")}: </b>}
          {line}
        </Note>
      ))}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: a scrollable region must be scrollable by keyboard */}
      <div class="tune-table" role="region" aria-label={strings.title} tabIndex={0}>
        <DataTable
          label={strings.title}
          testid="step-metrics"
          rows={lines}
          id={line => line.testid}
          data={({ testid, differs }) => ({ testid, differs })}
          part={line => line.part}
          columns={columns}
        />
      </div>
    </section>
  );
}

/** One line of the table. */
interface Line {
  testid: string;
  name: string;
  note?: string;
  /** Title of the section that begins with this line. */
  part?: ComponentChildren;
  differs?: boolean;
  look?: (place: number) => string;
  cells: readonly ComponentChildren[];
  /** Difference between the first and the last run, and whether it is within the error. */
  difference?: string;
  within?: boolean;
}

function Hunting({ found }: { found: ReturnType<typeof lab.hunting> }) {
  const strings = words.metrics;
  const verdict = found?.hunting ?? "none";
  if (verdict === "none" || !found) return <>{strings.verdict[verdict]}</>;
  return (
    <>
      <Glyph kind="warning" size={13} /> {strings.verdict[verdict]}
      <small>
        {strings.hertz(
          found.hunting_hz === null ? strings.unknown : number(found.hunting_hz, 1),
          withUnit(number(found.hunting_rms_deg ?? 0, 2), "°"),
        )}
      </small>
    </>
  );
}

function conditions(shown: readonly StepRun[]): { name: string; values: string[] }[] {
  const strings = words.metrics;
  const or = (value: number | null, decimals: number, unit: string) =>
    value === null ? strings.unknown : withUnit(number(value, decimals), unit);
  return [
    { name: strings.supply, values: shown.map(run => or(run.voltage_v, 1, "V")) },
    { name: strings.board, values: shown.map(run => or(run.temperature_c, 0, "°C")) },
    { name: strings.firmware, values: shown.map(run => run.firmware ?? strings.unknown) },
    { name: strings.rate, values: shown.map(run => number(run.achieved_hz, 0)) },
    { name: strings.note, values: shown.map(run => run.note || strings.unknown) },
  ];
}

function under(key: lab.MetricKey, run: StepRun): string {
  const strings = words.metrics;
  if (key === "settling_s") return strings.settlingBand(withUnit(number(run.band_deg, 1), "°"));
  if (key === "steady_state_error_deg") return strings.errorMean;
  return key === "overshoot_pct" ? strings.ofStep : "";
}

type Kind = (typeof lab.METRICS)[number]["kind"];

function FigureCell({ one, kind, error }: { one: lab.MetricFigure | null; kind: Kind; error: number }) {
  const strings = words.metrics;
  if (one === null) return <span class="second">{kind === "time" ? strings.never : strings.unknown}</span>;
  return (
    <>
      {value(one.value, kind)}
      {kind === "time" && <small>{strings.plusMinus(ms(error))}</small>}
      {one.of > 1 && (
        <small>
          {one.reached < one.of
            ? strings.reached(one.reached, one.of)
            : strings.spread(value(one.low, kind), value(one.high, kind), one.of)}
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
