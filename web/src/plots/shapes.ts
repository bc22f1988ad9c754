/** Shapes of samples, which distinguish curves in addition to colour and letter. */

/** SVG paths around 0, 0, about 7 px across. */
const SHAPES = [
  "M3.2 0A3.2 3.2 0 1 1 -3.2 0A3.2 3.2 0 1 1 3.2 0z",
  "M-2.9 -2.9H2.9V2.9H-2.9z",
  "M0 -3.8L3.6 2.7H-3.6z",
  "M0 -4.1L4.1 0L0 4.1L-4.1 0z",
  "M0 3.8L3.6 -2.7H-3.6z",
  "M-1.2 -3.8H1.2V-1.2H3.8V1.2H1.2V3.8H-1.2V1.2H-3.8V-1.2H-1.2z",
  "M-3.8 -1.5H3.8V1.5H-3.8z",
  "M-1.5 -3.8H1.5V3.8H-1.5z",
] as const;

export function shape(place: number): string {
  return SHAPES[place % SHAPES.length] ?? SHAPES[0];
}
