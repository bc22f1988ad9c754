/** The English list of keys; loaded with it. */

/** A key, or two pressed one after the other, and what it does. */
type Line = readonly [key: string, what: string];

export const words = {
  title: "Keys",
  here: "On this page",
  everywhere: "Everywhere",
  pages: "Go to a page: g, then a letter",
  stop: [
    ["Esc", "Stop, while motion is on or a horn moves. Otherwise close the dialog, search or editor"],
    ["Esc Esc", "Stop, always: twice within 1\u202fs"],
    ["Space", "Stop, while motion is on and the focus is not in a box or on a button"],
    ["?", "These keys"],
    ["Tab", "To the next control; with Shift to the one before"],
  ] as readonly Line[],
  search: ["/", "Search on this page"] as Line,
  rows: ["j k ↑ ↓", "The row below or above"] as Line,
  open: ["Enter", "Open the servo of the row"] as Line,
  tick: ["x", "Select the servo of the row, or no longer"] as Line,
  select: ["← →", "The tab before or after, when a tab has focus"] as Line,
  wiggle: ["W", "Wiggle the servo, or the selected servos, by ±3°"] as Line,
  apply: ["Ctrl Enter", "Apply the staged changes to RAM, as the button does"] as Line,
  save: [
    "Ctrl S",
    "Review the changes, then save them to ROM. Nothing is written before you confirm",
  ] as Line,
  reviewAll: ["Ctrl Enter", "Review and apply the staged changes"] as Line,
  saveAll: ["Ctrl S", "As Ctrl Enter; without staged changes: save RAM to ROM, after a review"] as Line,
  undo: ["Ctrl Z", "Take the last staged edit back"] as Line,
  number: ["↑ ↓", "Change a number by one unit, when its box has focus. Shift ×10, Alt ÷10"] as Line,
  enter: ["Enter", "Stage what was typed"] as Line,
  gainEnter: ["Enter", "Stage the typed gain. Only the button starts a step test"] as Line,
  jog: ["← →", "Jog by 1°, when the jog pad has focus. Shift 10°, Alt 0.1°"] as Line,
  jogZero: ["0", "Go to 0°, when the jog pad has focus"] as Line,
  jogHold: ["← →", "On Speed and Torque: run that way while the key is held; letting go brakes"] as Line,
  jogEnter: ["Enter", "After typing an angle: to the button Go. On Go: send it"] as Line,
  monitor: ["↑ ↓", "The transfer before or after, when the monitor has focus"] as Line,
  scrub: ["← →", "One sample in a recording, when its time line has focus. Shift 1\u202fs"] as Line,
  scrubEnds: ["Home End", "Start and end of a recording, when its time line has focus"] as Line,
  scopeCursors: ["1 2", "Choose cursor 1 or 2; then ← → move it by one sample, Shift ×10"] as Line,
  scopeArm: ["T", "Arm the trigger again"] as Line,
  scopeMemory: ["← →", "Move the window, when the memory strip has focus. End returns to live"] as Line,
  composing:
    "While an input method composes text, Esc and Enter belong to it and stop nothing. The Stop button always works.",
  scroll: ["↑ ↓", "Scroll, when a list has focus"] as Line,
};
