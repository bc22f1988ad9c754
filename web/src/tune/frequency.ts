/** Frequency responses: which belong to the shown runs, their pictures, and their figures. */
import type {
  Estimate,
  FrequencyCurve,
  FrequencyMetrics,
  FrequencyResponse,
  StepRun,
} from "../api/lab-types";
import type { Hatched } from "../plots/annotate";
import type { Picture } from "../plots/plot";
import type { PlotCurve } from "../plots/series";
import { type Samples, still } from "../plots/trace";
import { letter, sameGains } from "./step-runs";

/** A response in the picture. */
export interface ShownResponse {
  response: FrequencyResponse;
  /** Index of its colour: that of its run. */
  place: number;
  /** Letter of the run with the same gains and set-up; null if none is shown. */
  letter: string | null;
}

/** The newest response of each shown run; the newest of all, if it belongs to none of them. */
export function responsesOf(
  runs: readonly StepRun[],
  responses: readonly FrequencyResponse[],
): ShownResponse[] {
  const shown = runs.flatMap((run, place): ShownResponse[] => {
    const response = responses.find(one => sameGains(one, run));
    return response ? [{ response, place, letter: letter(place) }] : [];
  });
  const newest = responses[0];
  if (newest && !shown.some(one => one.response.id === newest.id))
    shown.push({ response: newest, place: runs.length, letter: null });
  // Runs with the same gains share one response: it is drawn once, as that of the first.
  return shown.filter((one, at) => shown.findIndex(other => other.response.id === one.response.id) === at);
}

/** The curve at the requested amplitude: the middle one of a ladder. */
export function mainCurve(response: FrequencyResponse): FrequencyCurve | undefined {
  return response.curves[Math.floor(response.curves.length / 2)];
}

export const COHERENCE = 0.9;

export interface FrequencySentences {
  name: (one: ShownResponse, amplitude_deg: number | null) => string;
  peak: (db: number, hz: number) => string;
  bandwidth: (letter: string | null, hz: number) => string;
  notReliable: string;
  gain: string;
  phase: string;
  coherence: string;
  threshold: string;
}

export interface FrequencyPictures {
  gain: Picture;
  phase: Picture;
  coherence: Picture;
}

/** Three pictures over the logarithm of the frequency. Gain and phase are drawn where they are reliable only. */
export function frequencyPictures(
  shown: readonly ShownResponse[],
  say: FrequencySentences,
): FrequencyPictures {
  const drawn = shown.flatMap(one => {
    const main = mainCurve(one.response);
    if (!main) return [];
    const others = shown.length === 1 ? one.response.curves.filter(curve => curve !== main) : [];
    return [...others.map(curve => ({ one, curve, main: false })), { one, curve: main, main: true }];
  });
  const bold = shown.at(-1);
  const curves = (part: (curve: FrequencyCurve) => readonly number[]): PlotCurve[] =>
    drawn.map(({ one, curve, main }) => ({
      samples: still(reliablePart(curve, part(curve))),
      colour: shown.length === 1 && main ? "ink" : one.place,
      bold: main && one === bold,
      faint: !main,
      open: main,
      plain: true,
      name: say.name(one, one.response.curves.length > 1 ? curve.amplitude_deg : null),
      ...(main && shown.length > 1 && one.letter
        ? { tag: one.letter, tagAt: tagPlace(curve, one === bold) }
        : {}),
    }));
  const all = drawn.flatMap(({ curve }) => curve.frequency_hz);
  const limits = {
    from: Math.log10(Math.min(...all)),
    to: Math.log10(Math.max(...all)),
  };
  const hatched = unreliable(drawn.filter(each => each.main).map(({ curve }) => curve));
  const widest = Math.max(0, ...hatched.map(one => one.to - one.from));
  const named = hatched.map(one => (one.to - one.from === widest ? { ...one, word: say.notReliable } : one));
  const last = bold && mainCurve(bold.response)?.metrics;
  const first = shown.flatMap(one => {
    const found = mainCurve(one.response)?.metrics.bandwidth_3db_hz;
    return found ? { t: Math.log10(found.value), word: say.bandwidth(one.letter, found.value) } : [];
  })[0];
  return {
    gain: {
      ...limits,
      curves: curves(curve => curve.gain_db),
      hatched: named,
      corner: say.gain,
      feet: first ? [first] : [],
      callouts:
        last?.peak_db && last.peak_hz && last.peak_db.value >= NOTABLE_DB
          ? [
              {
                t: Math.log10(last.peak_hz),
                v: last.peak_db.value,
                word: say.peak(last.peak_db.value, last.peak_hz),
                dx: -10,
                dy: 0,
              },
            ]
          : [],
      range: found => rounded(found, 10, 5),
    },
    phase: {
      ...limits,
      // The letters are on the gain; here they would cover the curves.
      curves: curves(curve => curve.phase_deg).map(({ tag: _, ...curve }) => curve),
      hatched,
      corner: say.phase,
      range: found => rounded(found, 90, 20),
    },
    coherence: {
      ...limits,
      curves: drawn
        .filter(each => each.main)
        .flatMap(({ one, curve }): PlotCurve[] => [
          { samples: still(logged(curve, curve.coherence)), colour: "ink", faint: true, plain: true },
          {
            samples: still(reliablePart(curve, curve.coherence)),
            colour: shown.length === 1 ? "ink" : one.place,
            bold: one === bold,
            plain: true,
            name: say.name(one, null),
          },
        ]),
      hatched,
      corner: say.coherence,
      bands: [{ low: COHERENCE, high: COHERENCE, label: say.threshold }],
      range: () => [0, 1.1],
    },
  };
}

const NOTABLE_DB = 1;

/** The letter of the last response is beside its peak, that of others where the gain begins to fall. */
function tagPlace({ metrics, frequency_hz }: FrequencyCurve, last: boolean): { x: number; above: boolean } {
  const { peak_db, peak_hz, bandwidth_3db_hz } = metrics;
  if (last && peak_hz && peak_db && peak_db.value >= NOTABLE_DB)
    return { x: Math.log10(peak_hz) + 0.06, above: true };
  const middle = bandwidth_3db_hz?.value ?? frequency_hz[Math.floor(frequency_hz.length / 2)] ?? 1;
  return { x: Math.log10(middle) - 0.12, above: last };
}

/** Limits at multiples of a step, with room above and below. */
function rounded(found: readonly [number, number] | null, step: number, room: number): [number, number] {
  const [low, high] = found ?? [-step, 0];
  return [Math.min(-step, Math.floor((low - room) / step) * step), Math.max(room, high + room)];
}

function logged(curve: FrequencyCurve, values: readonly number[]): Samples {
  return { t: Float64Array.from(curve.frequency_hz, Math.log10), v: Float64Array.from(values) };
}

function reliablePart(curve: FrequencyCurve, values: readonly number[]): Samples {
  const v = Float64Array.from(values, (value, at) => (curve.reliable[at] ? value : Number.NaN));
  return { t: Float64Array.from(curve.frequency_hz, Math.log10), v };
}

/** Where no curve is reliable, in the logarithm of the frequency: below the lowest, above the highest, and in gaps. */
export function unreliable(curves: readonly FrequencyCurve[]): Hatched[] {
  const all = curves
    .flatMap(curve => curve.frequency_hz.map((hz, at) => ({ hz, ok: curve.reliable[at] === true })))
    .sort((a, b) => a.hz - b.hz || Number(b.ok) - Number(a.ok));
  const found: Hatched[] = [];
  const lowest = all[0]?.hz;
  const highest = all.at(-1)?.hz;
  if (lowest === undefined || highest === undefined) return [];
  // A single missing frequency between reliable ones is a gap in the line, not an area.
  const reliable = all.filter(one => one.ok).map(one => one.hz);
  const edges = [lowest, ...reliable, highest];
  for (let at = 1; at < edges.length; at++) {
    const from = edges[at - 1] ?? 0;
    const to = edges[at] ?? 0;
    const between = all.filter(one => !one.ok && one.hz >= from && one.hz <= to);
    const atEnd = at === 1 || at === edges.length - 1;
    if (to > from && (between.length > GAP || (atEnd && between.length > 0)))
      found.push({ from: Math.log10(from), to: Math.log10(to) });
  }
  return found;
}

const GAP = 2;

/** Round frequencies on a logarithmic axis: 1, 2, 5 of each decade. */
export function decadeTicks(from: number, to: number): number[] {
  const ticks: number[] = [];
  for (let decade = Math.floor(from); decade <= Math.ceil(to); decade++)
    for (const one of [1, 2, 5]) {
      const at = decade + Math.log10(one);
      if (at >= from - 1e-9 && at <= to + 1e-9) ticks.push(at);
    }
  return ticks;
}

export type FrequencyKey =
  | "bandwidth_3db_hz"
  | "phase_margin_deg"
  | "gain_margin_db"
  | "bandwidth_90deg_hz"
  | "delay_s";

export function estimateOf(metrics: FrequencyMetrics | undefined, key: FrequencyKey): Estimate | null {
  return metrics?.[key] ?? null;
}

/** Half of the 95 % interval. */
export function half(one: Estimate): number {
  return (one.high - one.low) / 2;
}
