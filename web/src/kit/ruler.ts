/** Ruled scales: a base line with ticks above it. */

/** SVG path of a scale of `parts` equal parts; `top` is the upper end of the tick at each division. */
export function ruler(width: number, parts: number, base: number, top: (division: number) => number): string {
  let path = `M0 ${base}H${width}`;
  for (let i = 0; i <= parts; i++) path += `M${(width * i) / parts} ${top(i)}V${base}`;
  return path;
}
