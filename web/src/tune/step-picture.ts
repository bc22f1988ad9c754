/** Picture of step tests: overlaid runs, each relative to its start, with target and band. */
import type { StepRun } from "../api/lab-types";
import { type Picture, roomy } from "../plots/plot";
import type { PlotCurve } from "../plots/series";
import { samples, still } from "../plots/trace";
import { type Direction, letter, stepsOf } from "./step-runs";

/** Share of the time shown before the command. */
const BEFORE = 0.04;

export function stepPicture(
  runs: readonly StepRun[],
  direction: Direction,
  chosen: number | null,
  bandLabel: (deg: number) => string,
): Picture {
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
        bold: run.id === chosen || alone,
        ...(first && !alone ? { tag: letter(place), shape: place } : {}),
        ...(first ? { name: letter(place) } : {}),
      });
    });
  });
  const before = -BEFORE * longest;
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
  const of = runs.find(run => run.id === chosen) ?? runs.at(-1);
  const target = targets[of ? runs.indexOf(of) : 0];
  const bands =
    of && target !== undefined
      ? [{ low: target - of.band_deg, high: target + of.band_deg, label: bandLabel(of.band_deg) }]
      : [];
  return { curves, bands, from: before, to: longest, range: roomy(2, bands) };
}
