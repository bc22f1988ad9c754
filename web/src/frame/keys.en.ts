/** English words of the list of keyboard shortcuts; loaded with it. */

/** A key, or two in sequence, and its action. */
type Line = readonly [key: string, what: string];

export const words = {
  title: "Keyboard shortcuts",
  here: "On this page",
  everywhere: "Everywhere",
  pages: "Go to a page: press g, then a letter",
  stop: [
    ["Esc", "Stop while motion is on or a horn moves. Otherwise close the dialog, search or editor"],
    ["Esc Esc", "Stop in any case: press twice within 1\u202fs"],
    ["Space", "Stop while motion is on, unless a text box or button has focus"],
    ["?", "Show the keyboard shortcuts"],
    ["Tab", "Next control. With Shift: previous control"],
  ] as readonly Line[],
  search: ["/", "Search on this page"] as Line,
  rows: ["j k ↑ ↓", "Next or previous row"] as Line,
  open: ["Enter", "Open the servo in the row"] as Line,
  tick: ["x", "Select or deselect the servo in the row"] as Line,
  select: ["← →", "Previous or next tab, when a tab has focus"] as Line,
  wiggle: ["W", "Wiggle the servo, or the selected servos, by ±3°"] as Line,
  apply: ["Ctrl Enter", "Apply the staged changes to RAM, like the button"] as Line,
  save: [
    "Ctrl S",
    "Review the changes, then save them to ROM. Nothing is written before you confirm",
  ] as Line,
  reviewAll: ["Ctrl Enter", "Review and apply the staged changes"] as Line,
  saveAll: ["Ctrl S", "Like Ctrl Enter. Without staged changes: review, then save RAM to ROM"] as Line,
  undo: ["Ctrl Z", "Undo the last staged edit"] as Line,
  number: ["↑ ↓", "Change a number by one unit, when its box has focus. Shift ×10, Alt ÷10"] as Line,
  enter: ["Enter", "Stage the typed value"] as Line,
  gainEnter: ["Enter", "Stage the typed gain. Only the button starts a step test"] as Line,
  jog: ["← →", "Jog by 1°, when the jog pad has focus. Shift 10°, Alt 0.1°"] as Line,
  jogZero: ["0", "Go to 0°, when the jog pad has focus"] as Line,
  jogHold: [
    "← →",
    "On Speed and Torque: run in that direction while the key is held. Releasing it brakes",
  ] as Line,
  jogEnter: ["Enter", "After typing an angle: move to the Go button. On Go: send the angle"] as Line,
  monitor: ["↑ ↓", "Previous or next transfer, when the monitor has focus"] as Line,
  scrub: ["← →", "Move by one sample in a recording, when its timeline has focus. Shift 1\u202fs"] as Line,
  scrubEnds: ["Home End", "Go to the start or end of a recording, when its timeline has focus"] as Line,
  scopeCursors: ["1 2", "Choose cursor 1 or 2. Then ← → move it by one sample, Shift ×10"] as Line,
  scopeArm: ["T", "Rearm the trigger"] as Line,
  scopeMemory: ["← →", "Move the window, when the memory strip has focus. End returns to live"] as Line,
  composing:
    "While an input method is composing text, Esc and Enter go to it and do not stop servos. The Stop button always works.",
  scroll: ["↑ ↓", "Scroll, when a list has focus"] as Line,
};
