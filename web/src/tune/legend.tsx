/** How a run is named everywhere: its letter in a box, the line of its curve, its gains. */
import type { StepRun } from "../api/lab-types";
import { number, withUnit } from "../bench/format";
import { shape } from "../plots/shapes";
import { letter } from "./step-runs";

function colourOf(place: number): string {
  return `var(--series-${(place % 8) + 1})`;
}

/** The letter of a run, in a box of its colour. */
export function LetterBox({ place }: { place: number }) {
  return (
    <b class="tune-box" style={{ borderColor: colourOf(place) }}>
      {letter(place)}
    </b>
  );
}

/** Line of a run, as wide as its curve; with a shape if there are more than two. */
export function Swatch({ place, of }: { place: number; of: number }) {
  const colour = of === 1 ? "var(--ink)" : colourOf(place);
  return (
    <svg class="swatch" width="24" height="14" viewBox="-12 -7 24 14" aria-hidden="true">
      <path d="M-12 0H12" stroke={colour} stroke-width={place === of - 1 ? 2.6 : 1.5} />
      {of > 2 && <path d={shape(place)} fill={colour} />}
    </svg>
  );
}

/** "P 40, D 40". */
export function gainsOf(run: Pick<StepRun, "parameters">): string {
  return [
    ["P", run.parameters.angle_p_gain],
    ["D", run.parameters.angle_d_gain],
  ]
    .flatMap(([name, value]) => (typeof value === "number" ? `${name} ${number(value, 0)}` : []))
    .join(", ");
}

/** Milliseconds, with at most one decimal. */
export function ms(s: number): string {
  const millis = s * 1000;
  return withUnit(number(millis, Math.abs(millis) < 9.95 && millis % 1 !== 0 ? 1 : 0), "ms");
}
