/** The page's own icons: 18 px grid, 1.5 px stroke, square caps, in the colour of their text. */

const PATHS = {
  servos: "M3 7.5h9v8H3zM1.5 12.5H3M12 12.5h1.5M7.5 7.5V5M6 4.5a1.5 1.5 0 1 1 2.4 1.2M8.5 3.5L15 5.5",
  parameters:
    "M1.5 4.5H10M13 4.5h3.5M10 3v3h3V3zM1.5 9H4M7 9h9.5M4 7.5v3h3v-3zM1.5 13.5H9M12 13.5h4.5M9 12v3h3v-3z",
  matrix: "M2.5 2.5h13v13h-13zM2.5 6.8h13M2.5 11.2h13M6.8 2.5v13M11.2 2.5v13",
  motion: "M2.5 13a7 7 0 1 1 13 0M9 11l3.5-4.5M9 12.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3z",
  scope: "M1.5 3h15v10h-15zM6 16h6M9 13v3M4 9h2l1.5-3 2.5 5 1.5-2H14",
  single: "M3 3.5l6 5.5-6 5.5zM11.5 3.5v11M14.5 3.5v11",
  tune: "M1.5 14H5c2.5 0 1.8-9.5 4.2-9.5 1.8 0 1.2 3.2 3 3.2h4.3",
  bus: "M1 6h16M1 12h16M4.5 6v6M9 6v6M13.5 6v6",
  copy: "M6 6V2.5h9.5V12H12M2.5 6H12v9.5H2.5z",
  keys: "M1.5 4.5h15v9h-15zM4 7h1M7 7h1M10 7h1M13 7h1M5 10.8h8",
  search: "M7.5 12.5a5 5 0 1 0 0-10 5 5 0 0 0 0 10zM11.3 11.3L16 16",
  pencil: "M3 15l.8-3.2L12 3.6l2.4 2.4-8.2 8.2zM10.5 5.1l2.4 2.4",
  pause: "M6 3.5v11M12 3.5v11",
  play: "M5.5 3.5l8 5.5-8 5.5z",
  download: "M9 2.5v8.5M5.5 8L9 11.5 12.5 8M3 15h12",
  tick: "M3.5 9.5l3.5 3.5 7.5-8",
  half: "M9 3a6 6 0 1 0 0 12 6 6 0 0 0 0-12z",
  none: "M9 3a6 6 0 1 0 0 12A6 6 0 0 0 9 3zM4.8 4.8l8.4 8.4",
  down: "M4.5 7L9 11.5 13.5 7",
  left: "M11 4.5L6.5 9l4.5 4.5",
  right: "M7 4.5L11.5 9 7 13.5",
  wiggle: "M3 12a7 7 0 0 1 12 0M3 7.5V12h4.5M15 7.5V12h-4.5",
  faults: "M9 2.5L16.5 15.5h-15zM9 7v4.2M9 13v.5",
  commission: "M2 4.2l1.4 1.4L6 3M8.5 4.5H16M2 9.7l1.4 1.4L6 8.5M8.5 10H16M2.5 15h2M8.5 15H16",
  recorder:
    "M9 1.8a7.2 7.2 0 1 0 0 14.4a7.2 7.2 0 0 0 0-14.4zM9 6.2a2.8 2.8 0 1 0 0 5.6a2.8 2.8 0 0 0 0-5.6z",
  records: "M4 1.5h7l3.5 3.5v11.5H4zM11 1.5V5h3.5M6.5 9h5M6.5 12.5h5",
  api: "M5.5 4L1.5 9l4 5M12.5 4l4 5-4 5M10.5 3l-3 12",
  docs: "M9 4.5v11M9 4.5C7 3 4.5 2.7 1.5 3v10.5c3-.3 5.5 0 7.5 2 2-2 4.5-2.3 7.5-2V3c-3-.3-5.5 0-7.5 1.5",
  site: "M2.5 15.5v-7h5v7M7.5 15.5v-13h8v13M1.5 15.5h15M10 5.5h1M13 5.5h.5M10 8.5h1M13 8.5h.5M10 11.5h1M13 11.5h.5",
  more: "M3 9h.5M8.75 9h.5M14.5 9h.5",
  guest:
    "M1.5 9C4 5 6.5 3.5 9 3.5S14 5 16.5 9C14 13 11.5 14.5 9 14.5S4 13 1.5 9zM9 11.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5z",
  lock: "M4 8.5h10v7H4zM6 8.5V6a3 3 0 0 1 6 0v2.5",
} as const;

export type IconName = keyof typeof PATHS;

/** An icon. Always beside a word, so hidden from screen readers. */
export function Icon({ name, size = 18 }: { name: IconName; size?: number }) {
  return (
    <svg class="icon" width={size} height={size} viewBox="0 0 18 18" aria-hidden="true">
      <path d={PATHS[name]} fill="none" stroke="currentColor" stroke-width="1.5" stroke-linecap="square" />
      {name === "half" && <path d="M9 3a6 6 0 0 0 0 12z" fill="currentColor" />}
    </svg>
  );
}

/** The open ring, one turn a second: in progress. */
export function Spinner({ size = 16 }: { size?: number }) {
  return (
    <svg class="icon spin" width={size} height={size} viewBox="0 0 16 16" aria-hidden="true">
      <path d="M13.5 8A5.5 5.5 0 1 1 8 2.5" fill="none" stroke="currentColor" stroke-width="1.7" />
    </svg>
  );
}

/** The mark: hub and horn as a hornbill's head and bill, the limit arc as its casque. */
export function Mark({ size = 34 }: { size?: number }) {
  return (
    <svg class="icon" width={size} height={size} viewBox="0 0 34 34" aria-hidden="true">
      <path d="M13 9.5C18 7 26 8.5 33 17.5c-5-2-8.5-2.2-12-.7A9 9 0 1 1 13 9.5z" fill="currentColor" />
      <circle cx="12.5" cy="18.8" r="5" fill="var(--panel)" />
      <circle cx="12.5" cy="18.8" r="2.3" fill="currentColor" />
      <path d="M10 6.5C14 3.2 20 2.8 25 6" fill="none" stroke="var(--limit)" stroke-width="2.4" />
    </svg>
  );
}
