/** A ruled scale: open triangles at the exported ends, an ink bar over what was seen on the bus. */
import type { VerifyRow } from "../api/autopilot-types";
import { ruler } from "../kit/ruler";

const WIDTH = 160;
const STEPS = 18;

export function RangeScale({ one, half }: { one: VerifyRow; half: number }) {
  const place = (degrees: number) => ((Math.max(-half, Math.min(half, degrees)) + half) / (2 * half)) * WIDTH;
  const triangle = (degrees: number) => {
    const x = place(degrees);
    return `M${x} 13.5l4.5 7.5h-9z`;
  };
  return (
    <svg
      class="range-scale"
      width={WIDTH + 12}
      height="22"
      viewBox={`-6 0 ${WIDTH + 12} 22`}
      aria-hidden="true"
    >
      <path
        d={ruler(WIDTH, STEPS, 9.5, i => (i % (STEPS / 2) === 0 ? 2 : 5))}
        stroke="var(--edge)"
        stroke-width="1"
        fill="none"
      />
      {one.seen_low_deg !== null && one.seen_high_deg !== null && (
        <path
          d={`M${Math.min(place(one.seen_low_deg), WIDTH - 2)} 9.5H${Math.max(place(one.seen_high_deg), place(one.seen_low_deg) + 2)}`}
          stroke="var(--ink)"
          stroke-width="4"
        />
      )}
      <path
        d={triangle(one.low_deg) + triangle(one.high_deg)}
        stroke="var(--ink-2)"
        stroke-width="1.2"
        fill="none"
      />
    </svg>
  );
}
