/** Owns the drawing of a row's range: ink bar = RAM, blue ring = staged, open triangle = default, chevron = beyond. */
import { placeOf, type Scale } from "./scale";

interface Props {
  scale: Scale;
  held: number | null;
  standard: number | null;
  staged: number | null;
  beyond: "above" | "below" | null;
  label: string;
}

const WIDTH = 112;
const LINE = 13;
const PARTS = 10;

export function Ruler({ scale, held, standard, staged, beyond, label }: Props) {
  const x = (value: number) => placeOf(value, scale) * WIDTH;
  return (
    <svg
      class="ruler"
      width={WIDTH + 20}
      height="28"
      viewBox={`-8 0 ${WIDTH + 20} 28`}
      role="img"
      aria-label={label}
    >
      <path d={TICKS} stroke="var(--edge)" fill="none" />
      {staged !== null && held !== null && (
        <path d={`M${x(held)} ${LINE}H${x(staged)}`} stroke="var(--intent)" stroke-width="2" />
      )}
      {standard !== null && (
        <path d={`M${x(standard)} 19l3.6 6.5h-7.2z`} fill="none" stroke="var(--ink-3)" stroke-width="1.2" />
      )}
      {held !== null && <path d={`M${x(held)} 5.5V20`} stroke="var(--ink)" stroke-width="3" />}
      {staged !== null && (
        <circle cx={x(staged)} cy={LINE} r="5.5" fill="var(--well)" stroke="var(--intent)" stroke-width="2" />
      )}
      {beyond && (
        <path
          d={beyond === "above" ? `M${WIDTH + 4} 6l5 7-5 7` : "M-3 6l-4 7 4 7"}
          fill="none"
          stroke="var(--failure)"
          stroke-width="2"
        />
      )}
    </svg>
  );
}

const TICKS = Array.from({ length: PARTS + 1 }, (_, i) => {
  const long = i % (PARTS / 2) === 0;
  return `M${(i * WIDTH) / PARTS} ${long ? 6 : 9}V${LINE}`;
}).reduce((path, tick) => path + tick, `M0 ${LINE}H${WIDTH}`);
