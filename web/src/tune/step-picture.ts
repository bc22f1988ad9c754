/** Picture of step tests: overlaid runs, each relative to its start, with target, band, settling and hunting. */
import type { StepRun } from "../api/lab-types";
import type { Callout, MarkAt } from "../plots/annotate";
import { type Picture, roomy } from "../plots/plot";
import type { PlotCurve } from "../plots/series";
import { samples, still } from "../plots/trace";
import { type Direction, figure, hunting, hunts, letter, stepsOf } from "./step-runs";

/** Share of the time shown before the command. */
const BEFORE = 0.06;
/** Time after the command that is shown at least, s, and in multiples of the settling time. */
const LEAST_S = 0.5;
const SETTLINGS = 3;

export interface StepSentences {
  band: (deg: number) => string;
  settled: (letter: string, s: number) => string;
  hunts: (hz: number | null, rms_deg: number) => string;
}

export function stepPicture(
  runs: readonly StepRun[],
  direction: Direction,
  say: StepSentences,
): Picture & { window: [number, number] } {
  const alone = runs.length === 1;
  const curves: PlotCurve[] = [];
  let longest = 0.05;
  const targets = runs
    .flatMap(run => stepsOf(run, direction).slice(0, 1))
    .map(step => step.to_deg - step.from_deg);
  const shared = targets.every(one => Math.abs(one - (targets[0] ?? 0)) < 0.35);
  runs.forEach((run, place) => {
    stepsOf(run, direction).forEach((step, repeat) => {
      const last = step.t.at(-1) ?? 0;
      longest = Math.max(longest, last);
      const first = repeat === 0;
      curves.push({
        samples: still(samples(step.t, step.angle_deg, 0, step.from_deg)),
        colour: alone ? "ink" : place,
        bold: place === runs.length - 1,
        // Two lines differ by their width and letters; shapes are for more.
        ...(runs.length > 2 ? { shape: place } : { plain: !alone }),
        ...(first && !alone ? { tag: letter(place) } : {}),
        ...(first ? { name: letter(place) } : {}),
      });
    });
  });
  const window = windowOf(runs, direction, longest);
  const before = window[0];
  runs.forEach((run, place) => {
    const step = stepsOf(run, direction)[0];
    if (!step || (shared && place > 0)) return;
    const target = step.to_deg - step.from_deg;
    curves.unshift({
      samples: still(samples([before, 0], [0, target])),
      colour: shared ? "intent" : place,
      dashed: true,
      held: true,
    });
  });
  const last = runs.at(-1);
  const target = targets.at(-1);
  const bands =
    last && target !== undefined
      ? [{ low: target - last.band_deg, high: target + last.band_deg, label: say.band(last.band_deg) }]
      : [];
  return {
    curves,
    bands,
    feet: settled(runs, direction, say),
    callouts: last && target !== undefined ? swing(last, direction, target, window, say) : [],
    from: before,
    to: longest,
    window,
    range: roomy(2, bands),
  };
}

/** The time in which something happens; all of it if a run never settles. */
function windowOf(runs: readonly StepRun[], direction: Direction, longest: number): [number, number] {
  const times = runs.map(run => figure(run, direction, "settling_s")?.high ?? 0);
  const to = Math.min(longest, Math.max(LEAST_S, SETTLINGS * Math.max(0, ...times)));
  return [-BEFORE * to, to];
}

function settled(runs: readonly StepRun[], direction: Direction, say: StepSentences): MarkAt[] {
  // One at most: two words at the foot would overlap, and the table has all of them.
  const marks = runs.flatMap((run, place) => {
    const found = figure(run, direction, "settling_s");
    return found
      ? { t: found.value, word: say.settled(runs.length > 1 ? letter(place) : "", found.value) }
      : [];
  });
  return marks.slice(0, 1);
}

/** Names the hunting of a run at one of its later swings. */
function swing(
  run: StepRun,
  direction: Direction,
  target: number,
  [, to]: readonly [number, number],
  say: StepSentences,
): Callout[] {
  const found = hunting(run, direction);
  const step = stepsOf(run, direction)[0];
  if (!step || !found || !hunts(found) || found.hunting_rms_deg === null) return [];
  const away = Math.sign(target) || 1;
  let at = -1;
  step.t.forEach((t, place) => {
    const angle = (step.angle_deg[place] ?? 0) * away;
    if (t > SWING_FROM * to && t < SWING_TO * to && (at < 0 || angle > (step.angle_deg[at] ?? 0) * away))
      at = place;
  });
  if (at < 0) return [];
  const [t, v] = [step.t[at] ?? 0, (step.angle_deg[at] ?? 0) - step.from_deg];
  return [{ t, v, word: say.hunts(found.hunting_hz, found.hunting_rms_deg), dx: 12, dy: -away * 22 }];
}

/** Part of the picture in which a swing is named: late enough to be no overshoot, with space for the words. */
const SWING_FROM = 0.35;
const SWING_TO = 0.6;
