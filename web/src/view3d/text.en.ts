/** The English sentences of the 3D view, and the wall of horns; loaded with them. */

export const words = {
  frame: "3D view",
  qualities: { auto: "Quality: auto", high: "Quality: high", low: "Quality: low" },
  qualityAuto: { high: "Quality: auto, high", low: "Quality: auto, low" },
  qualityHint: "High draws reflections and shadows. Low is for machines that draw in software.",
  reset: "Reset view",
  all: "Show all",
  allHint: "Shows the other servos behind this one, too.",
  grip: {
    horn: "Drag to move the horn",
    ccw: "Drag to stage the CCW angle limit",
    cw: "Drag to stage the CW angle limit",
    off: "Nothing moves: motion is off. Enable motion on the Motion page, then drag the horn.",
    notNow:
      "Nothing moves: the horn can be dragged while torque is on, Angle is chosen and the drag is unlocked.",
    noDraft: "The angle limits cannot be changed now.",
    staged: (low: string, high: string) => `Staged, not sent: ${low} to ${high}`,
  },
  replay: {
    frame: "3D view of the recording",
    band: "Recording, not live",
    noValue: "No angle yet at this time",
    angles: (angle: string, command: string) => `${angle}, command ${command}`,
    old: "Nothing was heard here: the last value stands",
    noModel: "Model not recorded: drawn as a BLA21",
  },
  wall: (count: number) => (count === 1 ? "1 horn" : `${count} horns`),
  wallOpen: (name: string, angle: string, state: string) => `${name}, ${angle}, ${state}`,
  wallEmpty: "No servo is known yet. Connect, and each servo appears here with its horn.",
  wallOld: (angle: string, age: string) => `${angle}, ${age} old`,
  wallLost: "Frozen. No link to hornbill",
};
