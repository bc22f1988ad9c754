/** English words common to all pages of a servo; loaded with them. */

export const words = {
  head: {
    tabs: "Pages of this servo",
    before: "Previous servo",
    after: "Next servo",
    place: (n: number, of: number) => `${n} of ${of}`,
    saved: "All values are in ROM",
    notKnown: "ROM not known",
    owed: (name: string, rows: string) =>
      `${name} still has temporary values: ${rows}. They are restored as soon as it responds. It does not move until then.`,
  },
  side: {
    angle: "Angle",
    command: "Command",
    inactive: "inactive",
    speed: "Speed",
    torque: "Torque",
    about: "about",
    board: "Board",
    boardTolerance: "±5\u202f°C",
    supply: "Supply",
    supplyTolerance: "±0.5\u202fV",
  },
};
