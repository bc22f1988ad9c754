/** Owns the English list of keys; loaded with it. */

/** A key, or two pressed one after the other, and what it does. */
type Line = readonly [key: string, what: string];

export const words = {
  title: "Keys",
  here: "On this page",
  everywhere: "Everywhere",
  pages: "Go to a page: g, then a letter",
  stop: [
    ["Esc", "Stop. Closes a dialog too, without acting"],
    ["Space", "Stop, unless you type or are on a button"],
    ["?", "These keys"],
    ["Tab", "To the next control; with Shift to the one before"],
  ] as readonly Line[],
  search: ["/", "Search on this page"] as Line,
  select: ["← →", "The tab before or after, when a tab has focus"] as Line,
  diff: ["Ctrl S", "Show the staged changes; never saves"] as Line,
  undo: ["Ctrl Z", "Take the last staged edit back"] as Line,
  number: ["↑ ↓", "Change a number by one unit, when its box has focus. Shift ×10, Alt ÷10"] as Line,
  enter: ["Enter", "Stage what was typed"] as Line,
  jog: ["← →", "Jog by 1°, when the jog pad has focus. Shift 10°, Alt 0.1°"] as Line,
  jogZero: ["0", "Go to 0°, when the jog pad has focus"] as Line,
  jogHold: ["← →", "On Speed and Torque: run that way while the key is held; letting go brakes"] as Line,
  jogEnter: ["Enter", "Send the angle that was typed"] as Line,
  monitor: ["↑ ↓", "The transfer before or after, when the monitor has focus"] as Line,
  scrub: ["← →", "One sample in a recording, when its time line has focus. Shift 1\u202fs"] as Line,
  scrubEnds: ["Home End", "Start and end of a recording, when its time line has focus"] as Line,
  scroll: ["↑ ↓", "Scroll, when a list has focus"] as Line,
};
