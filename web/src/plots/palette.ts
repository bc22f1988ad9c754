/** Colours for canvases: the tokens of the present theme. */

export interface Palette {
  ink: string;
  ink2: string;
  ink3: string;
  line: string;
  edge: string;
  well: string;
  panel: string;
  intent: string;
  limit: string;
  /** Series colours for several servos or runs, in this order. */
  series: readonly string[];
  font: string;
}

let cached: Palette | null = null;
let of: string | undefined;

export function palette(): Palette {
  const root = document.documentElement;
  if (cached && of === root.dataset.theme) return cached;
  const style = getComputedStyle(root);
  const token = (name: string) => style.getPropertyValue(name).trim();
  of = root.dataset.theme;
  cached = {
    ink: token("--ink"),
    ink2: token("--ink-2"),
    ink3: token("--ink-3"),
    line: token("--line"),
    edge: token("--edge"),
    well: token("--well"),
    panel: token("--panel"),
    intent: token("--intent"),
    limit: token("--limit"),
    series: Array.from({ length: 8 }, (_, i) => token(`--series-${i + 1}`)),
    font: token("--font"),
  };
  return cached;
}
