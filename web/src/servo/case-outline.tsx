/** The case of a servo below its horn, seen from the name plate; sizes as in `server/hornbill/view/case.py`. */

interface Case {
  /** Millimetres along the case from the output shaft, and to either side. */
  back: number;
  front: number;
  halfWidth: number;
  corner: number;
  ear: number;
  earHalfWidth: number;
  hole: number;
  holeY: readonly number[];
  boss: number;
}

const BLA21: Case = {
  back: -30.0,
  front: 10.2,
  halfWidth: 10.5,
  corner: 2.4,
  ear: 7.2,
  earHalfWidth: 9.4,
  hole: 2.2,
  holeY: [-5.0, 5.0],
  boss: 8.4,
};
const BLA15: Case = {
  back: -27.6,
  front: 7.9,
  halfWidth: 7.6,
  corner: 1.9,
  ear: 5.8,
  earHalfWidth: 6.6,
  hole: 1.7,
  holeY: [0.0],
  boss: 6.3,
};
const OF_SERIES: Readonly<Record<string, Case>> = { BLA21, BLA15, BLA34: BLA21 };

/** Dial units per millimetre: case and ears stay within the face. */
const MM = 3.8;

export function CaseOutline({ series }: { series: string | null }) {
  const of = OF_SERIES[series ?? ""];
  if (!of) return null;
  const across = (y: number) => y * MM;
  const along = (x: number) => -x * MM;
  const ears = [
    { at: of.front, to: of.front + of.ear },
    { at: of.back - of.ear, to: of.back },
  ];
  return (
    <g class="case-outline">
      {ears.map(({ at, to }) => (
        <g key={at}>
          <rect
            x={across(-of.earHalfWidth)}
            y={along(to)}
            width={across(2 * of.earHalfWidth)}
            height={(to - at) * MM}
            rx={MM}
          />
          {of.holeY.map(y => (
            <circle key={y} cx={across(y)} cy={along((at + to) / 2)} r={of.hole * MM * 0.8} class="hole" />
          ))}
        </g>
      ))}
      <rect
        x={across(-of.halfWidth)}
        y={along(of.front)}
        width={across(2 * of.halfWidth)}
        height={(of.front - of.back) * MM}
        rx={of.corner * MM}
      />
      <rect
        x={across(-of.halfWidth + 3)}
        y={along(-of.boss - 4)}
        width={across(2 * of.halfWidth - 6)}
        height={(-of.boss - 6 - of.back) * MM}
        rx="3"
        class="plate"
      />
      <circle r={of.boss * MM} class="boss" />
    </g>
  );
}
