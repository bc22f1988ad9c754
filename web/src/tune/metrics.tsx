/** Results of runs: one column per run with errors, parameter differences, and conditions. */
import type { ComponentChildren } from "preact";
import type { Estimate, RunOverlay, StepRun } from "../api/lab-types";
import { catalog } from "../bench/catalog";
import { full, minute, number, signed, withUnit } from "../bench/format";
import { noteText } from "../bench/note-text";
import { type Column, DataTable } from "../kit/data-table";
import { Glyph } from "../kit/glyph";
import { Note } from "../kit/note";
import { estimateOf, type FrequencyKey, half, mainCurve, responsesOf } from "./frequency";
import { gainsOf, ms, Swatch } from "./legend";
import { setUpText } from "./set-up-text";
import { responses } from "./state";
import * as lab from "./step-runs";
import { tune as words } from "./words";

interface MetricsProps {
  overlay: RunOverlay;
  direction: lab.Direction;
}

export function Metrics({ overlay, direction }: MetricsProps) {
  const strings = words.metrics;
  const { runs: shown, differences, comparable, not_comparable: why } = overlay;
  const several = shown.length > 1;
  const warnings = lab.warned(shown);
  if (shown.length === 0) return null;
  const lines = linesOf(overlay, direction);
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
        <span class="tune-letter" data-testid={`legend-${lab.letter(place)}`}>
          <Swatch place={place} of={shown.length} />
          <b>{lab.letter(place)}</b>
          <span>{[minute(run.at), gainsOf(run)].filter(Boolean).join(", ")}</span>
        </span>
      ),
      right: true,
      look: (line: Line) => line.look?.(place) ?? "",
      cell: (line: Line) => line.cells[place],
    })),
  ];
  if (several && comparable)
    columns.push({
      key: "difference",
      head: strings.against(lab.letter(shown.length - 1), lab.letter(0)),
      right: true,
      look: () => "second",
      cell: line => (
        <>
          {line.difference}
          {line.within && <small>{strings.within}</small>}
        </>
      ),
    });
  const differ = Object.keys(differences).length;
  return (
    <div class="tune-metrics">
      {why && (
        <Note kind="notice" band testid="not-comparable">
          {noteText(why.text, why.code, why.params)}
        </Note>
      )}
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
          part={line =>
            line.part === "conditions" && several && differ === 0
              ? `${strings.conditions}. ${strings.same}`
              : line.part && strings[line.part]
          }
          columns={columns}
        />
      </div>
    </div>
  );
}

/** One line of the table. */
interface Line {
  testid: string;
  name: string;
  note?: string;
  /** Section that begins with this line. */
  part?: "more" | "parameters" | "conditions" | undefined;
  differs?: boolean;
  look?: (place: number) => string;
  cells: readonly ComponentChildren[];
  /** Difference between the first and the last run, and whether it is within the error. */
  difference?: string;
  within?: boolean;
}

/** Metrics that decide, then the others. */
const FIRST: readonly lab.MetricKey[] = ["settling_s", "rise_s", "overshoot_pct"];
const FREQUENCY_FIRST: readonly FrequencyKey[] = ["bandwidth_3db_hz", "phase_margin_deg"];
const FREQUENCY: readonly FrequencyKey[] = ["bandwidth_90deg_hz", "delay_s", "gain_margin_db"];

function linesOf({ runs: shown, differences }: RunOverlay, direction: lab.Direction): Line[] {
  const strings = words.metrics;
  const several = shown.length > 1;
  const last = shown.at(-1) as StepRun;
  const newest = (place: number) => (several && place === shown.length - 1 ? "strong" : "");
  const errors = shown.map(run => lab.sampleOf(run, direction));
  const error = Math.max(0, ...errors);
  const errorBoth = (errors[0] ?? 0) + (errors.at(-1) ?? 0);
  const metric = (key: lab.MetricKey): Line => {
    const kind = lab.METRICS[key];
    const figures = shown.map(run => lab.figure(run, direction, key));
    const found = several ? lab.compared(figures[0] ?? null, figures.at(-1) ?? null, kind, errorBoth) : null;
    return {
      testid: `metric-${key}`,
      name:
        key === "settling_s"
          ? strings.settling(withUnit(number(last.band_deg, 1), "°"))
          : (strings.names[key] ?? key),
      note:
        kind === "time"
          ? strings.plusMinus(ms(error))
          : key === "steady_state_error_deg"
            ? strings.errorMean
            : "",
      look: newest,
      cells: figures.map((one, place) => (
        <FigureCell key={place} one={one} kind={kind} settling={key === "settling_s"} />
      )),
      difference: found ? delta(found.delta, kind) : strings.none,
      within: found?.within ?? false,
    };
  };
  const measured = responsesOf(shown, responses.value ?? []);
  const estimates = (key: FrequencyKey): Line[] => {
    const found = shown.map((_, place) => {
      const one = measured.find(each => each.place === place);
      return one ? estimateOf(mainCurve(one.response)?.metrics, key) : undefined;
    });
    if (found.every(one => one === undefined)) return [];
    const base = found[0];
    const other = found.at(-1);
    return [
      {
        testid: `metric-${key}`,
        name: strings.frequency[key],
        note: strings.interval,
        look: newest,
        cells: found.map(one =>
          one ? (
            estimate(one, key)
          ) : (
            <span class="second">{one === null ? strings.notReliable : strings.notMeasured}</span>
          ),
        ),
        difference: base && other && several ? estimateDelta(other.value - base.value, key) : strings.none,
        within: Boolean(base && other && several && base.high >= other.low && other.high >= base.low),
      },
    ];
  };
  const rest = (Object.keys(lab.METRICS) as lab.MetricKey[]).filter(key => !FIRST.includes(key)).map(metric);
  const huntings = shown.map(run => lab.hunting(run, direction));
  return [
    ...FIRST.map(metric),
    {
      testid: "metric-hunting",
      name: strings.hunting,
      look: newest,
      cells: huntings.map((one, place) => <Hunting key={place} found={one} />),
      difference: several ? changed(huntings[0], huntings.at(-1)) : strings.none,
    },
    ...FREQUENCY_FIRST.flatMap(estimates),
    ...[...rest, ...FREQUENCY.flatMap(estimates)].map(
      (line, at): Line => ({ ...line, part: at === 0 ? "more" : undefined }),
    ),
    ...lab.differing(differences).map((key, place): Line => {
      const row = catalog.value?.rows.get(key);
      const values = differences[key] ?? [];
      return {
        testid: `differs-${key}`,
        part: place === 0 ? "parameters" : undefined,
        differs: true,
        name: row?.label ?? key,
        note: row?.name ?? "",
        look: at => (values[at] !== values[0] ? "strong k-intent" : ""),
        cells: values.map(one => (row ? full(one, { ...row, perUnit: row.per_unit }) : String(one))),
      };
    }),
    ...conditions(shown).map(
      ({ name, values }, place): Line => ({
        testid: `condition-${place}`,
        part: place === 0 ? "conditions" : undefined,
        name,
        look: () => "second tune-wrap",
        cells: values,
      }),
    ),
  ];
}

type Swing = ReturnType<typeof lab.hunting>;

/** Whether hunting began or ended from the first to the last run. */
function changed(base: Swing | undefined, other: Swing | undefined): string {
  const strings = words.metrics;
  if (lab.hunts(base) === lab.hunts(other)) return strings.none;
  return lab.hunts(other) ? strings.began : strings.gone;
}

function Hunting({ found }: { found: Swing }) {
  const strings = words.metrics;
  const verdict = found?.hunting ?? "none";
  if (verdict === "none" || !found) return <>{strings.verdict.none}</>;
  const swing = withUnit(number((found.hunting_rms_deg ?? 0) * Math.SQRT2, 1), "°");
  if (!lab.hunts(found)) return <>{strings.swing(strings.verdict.slight, swing)}</>;
  return (
    <>
      <Glyph kind="warning" size={13} />{" "}
      {found.hunting_hz === null
        ? strings.swing(strings.verdict[verdict], swing)
        : strings.swing(withUnit(number(found.hunting_hz, 0), "Hz"), swing)}
    </>
  );
}

function conditions(shown: readonly StepRun[]): { name: string; values: string[] }[] {
  const strings = words.metrics;
  const or = (value: number | null, decimals: number, unit: string) =>
    value === null ? strings.unknown : withUnit(number(value, decimals), unit);
  return [
    { name: strings.setUp, values: shown.map(run => setUpText(run.set_up) ?? strings.unknown) },
    { name: strings.supply, values: shown.map(run => or(run.voltage_v, 1, "V")) },
    { name: strings.board, values: shown.map(run => or(run.temperature_c, 0, "°C")) },
    { name: strings.firmware, values: shown.map(run => run.firmware ?? strings.unknown) },
    { name: strings.rate, values: shown.map(run => number(run.achieved_hz, 0)) },
    { name: strings.note, values: shown.map(run => run.note || strings.unknown) },
  ];
}

interface FigureProps {
  one: lab.MetricFigure | null;
  kind: lab.MetricKind;
  settling: boolean;
}

function FigureCell({ one, kind, settling }: FigureProps) {
  const strings = words.metrics;
  if (one === null)
    return settling ? (
      strings.unsettled
    ) : (
      <span class="second">{kind === "time" ? strings.never : strings.unknown}</span>
    );
  return (
    <>
      {value(one.value, kind)}
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

function value(one: number, kind: lab.MetricKind): string {
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

function delta(one: number, kind: lab.MetricKind): string {
  if (kind === "time") return withUnit(signed(one * 1000, 0), "ms");
  if (kind === "percent") return words.metrics.points(signed(one, 1));
  if (kind === "angle") return withUnit(signed(one, 2), "°");
  return withUnit(signed(one, 0), "rpm");
}

const ESTIMATES: Record<FrequencyKey, { unit: string; decimals: number; scale: number }> = {
  bandwidth_3db_hz: { unit: "Hz", decimals: 1, scale: 1 },
  bandwidth_90deg_hz: { unit: "Hz", decimals: 1, scale: 1 },
  phase_margin_deg: { unit: "°", decimals: 0, scale: 1 },
  gain_margin_db: { unit: "dB", decimals: 1, scale: 1 },
  delay_s: { unit: "ms", decimals: 1, scale: 1000 },
};

/** "6.2 Hz ±0.3". */
function estimate(one: Estimate, key: FrequencyKey): string {
  const { unit, decimals, scale } = ESTIMATES[key];
  return `${withUnit(number(one.value * scale, decimals), unit)} ±${number(half(one) * scale, decimals)}`;
}

function estimateDelta(found: number, key: FrequencyKey): string {
  const { unit, decimals, scale } = ESTIMATES[key];
  return withUnit(signed(found * scale, decimals), unit);
}
