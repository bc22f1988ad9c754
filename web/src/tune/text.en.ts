/** English text of the Tune page; loaded with it. */

const S = "\u202f";

/** "A", "A and B", "A, B and C". */
const and = (names: readonly string[]) =>
  [names.slice(0, -1).join(", "), names.at(-1)].filter(Boolean).join(" and ");

export const words = {
  /** Between the parts of a list. */
  list: ", ",
  noServo: "No servo to tune",
  noServoLine: "Measurements of a servo appear here as soon as it is on the bus.",
  toServos: "Go to Servos",

  verdict: {
    label: "Verdict",
    none: "Not measured yet",
    noneLine:
      "Run a step: a few degrees out and back, sampled as fast as the servo responds. Then change a gain or start Improve, and compare.",
    noneShown: "No run selected. Select one below.",
    howToRead: "How to read the plots",
    inRom: "as in ROM",
    back: (letter: string) => `Back to ${letter}`,
    backToRun: "Restore gains of this run",
    backHint: (letter: string) => `Write the gains of run ${letter} to RAM`,
    same: (letter: string) => `The servo has the gains of ${letter}.`,
  },

  step: {
    title: "Step",
    facts: (from: string, to: string, hz: string) => `${from} to ${to}, ${hz}${S}Hz`,
    open: "Run step…",
    nothing:
      "The angle over time after a step appears here: how fast the horn arrives, how far it overshoots, and whether it hunts.",
    direction: "Direction",
    there: "Out",
    back: "Back",
    label: (runs: string, direction: string) =>
      `Step response, angle relative to the start: ${runs}, ${direction}. The table below lists the results.`,
    band: (deg: string) => `±${deg}`,
    settled: (letter: string, ms: string) => (letter === "" ? `Settled, ${ms}` : `${letter} settled, ${ms}`),
    hunts: (hz: string | null, deg: string) => (hz === null ? `Hunting, ±${deg}` : `Hunting, ${hz}, ±${deg}`),
    hint: "Drag to zoom, double-click to show everything.",
    at: (time: string, values: string) => `${time}: ${values}`,
    one: (name: string, deg: string) => `${name} ${deg}`,

    dialogTitle: (name: string) => `Run a step on ${name}`,
    size: "Step",
    runs: "Runs",
    dwell: "Time per side",
    note: "Note",
    notePlace: "for example: new linkage",
    stepWrong: "Enter a step of −45 to +45°, not 0.",
    runsWrong: "Enter 1 to 20 runs.",
    dwellWrong: "Enter 0.3 to 10 s.",
    moves: (from: string, to: string) => `The horn moves from ${from} to ${to} and back`,
    times: (runs: number, s: string, most: string) =>
      `, ${runs === 1 ? "once" : `${runs} times`}, about ${s}, at up to ${most}.`,
    most: (rpm: string, pct: string) => `${rpm} and ${pct} torque`,
    mostUnknown: "its speed and torque limits",
    outside: (to: string, low: string, high: string) =>
      `${to} is outside the limits, ${low} to ${high}. Enter a smaller step or reverse its sign.`,
    unknownAngle: "The current angle is not known. Wait for the next reading.",
    wrongGain: "A gain is invalid. Correct or discard it first.",
    go: (n: string) => `Run step ${n}`,
    applyAndGo: (n: string) => `Apply and run step ${n}`,
    enableAndGo: (n: string) => `Enable motion and run step ${n}`,
    enableApplyAndGo: (n: string) => `Enable motion, apply and run step ${n}`,
    starting: "Starting",
    writesGains: (n: number) =>
      `${n === 1 ? "1 gain is" : `${n} gains are`} written to RAM first. The test saves nothing.`,
    writes: "The test writes no parameter and saves nothing.",
    enables:
      "Torque goes on and stays on until you turn motion off or leave this page. Keep clear of the horn.",
    notApplied: "Test not run: the gains were not written as entered. Check the gains.",
    motionEnded: "Test not run: motion ended while the gains were being written.",
  },

  frequency: {
    title: "Frequency response",
    facts: (amplitude: string, s: string) => `±${amplitude}, ${s}`,
    open: "Measure…",
    nothing:
      "Gain and phase over frequency appear here: how fast a motion the horn follows, and how much margin is left until it hunts.",
    packageMissing: (name: string) =>
      `This server lacks ${name}, which Improve and identification require. Install it with:`,
    label: (names: string) =>
      `Frequency response: gain, phase and coherence of ${names}. The table below lists the results.`,
    gain: "Gain, dB",
    phase: "Phase",
    coherence: "Coherence",
    notReliable: "not reliable",
    peak: (db: string, hz: string) => `${db} at ${hz}`,
    bandwidth: (letter: string, hz: string) =>
      letter === "" ? `−3${S}dB, ${hz}` : `${letter} −3${S}dB, ${hz}`,
    at: (hz: string, values: string) => `${hz}: ${values}`,

    dialogTitle: (name: string) => `Measure the frequency response of ${name}`,
    excitation: "Excitation",
    chirp: "Chirp: one rising frequency",
    multisine: "Multisine: all at once",
    amplitude: "Amplitude",
    fromHz: "From",
    toHz: "To",
    duration: "Duration",
    ladder: "Also at half and twice the amplitude, to find deadband and saturation",
    amplitudeWrong: (most: number) => `Enter an amplitude of 0.2 to ${most}°.`,
    rangeWrong: "Enter frequencies from 0.1 to 10 Hz and to 1 to 25 Hz, the lower one first.",
    durationWrong: "Enter 3 to 60 s.",
    outside: (low: string, high: string) =>
      `The horn would move outside its limits, ${low} to ${high}. Enter a smaller amplitude, or move the horn first.`,
    moves: (from: string, to: string) => `The horn moves between ${from} and ${to}`,
    takes: (s: string, most: string) => `, for about ${s}, at up to ${most}.`,
    go: "Measure",
    enableAndGo: "Enable motion and measure",
  },

  runs: {
    title: "Runs",
    lead: "Select up to eight runs to overlay them.",
    label: (letter: string) => `Run ${letter}`,
    show: (at: string) => `Show the run of ${at}`,
    facts: (step: string, hz: string) => `${step}, ${hz} samples/s`,
    csv: (at: string) => `CSV of the run of ${at}`,
    csvWord: "CSV",
    drop: (at: string) => `Delete the run of ${at}`,
    dropWord: "Delete…",
    dropTitle: (at: string) => `Delete the run of ${at}?`,
    dropText: "Its samples and results are deleted. This cannot be undone.",
    dropConfirm: "Delete run",
    loading: "Loading runs",
    failed: (why: string) => `The runs could not be loaded. ${why}`,
  },

  metrics: {
    title: "Results",
    metric: "Metric",
    against: (other: string, base: string) => `${other} against ${base}`,
    settling: (deg: string) => `Settling to ±${deg}`,
    names: {
      delay_s: "Delay to 5\u202f%",
      rise_s: "Rise 10 to 90\u202f%",
      crossing_s: "Target first reached",
      overshoot_pct: "Overshoot",
      steady_state_error_deg: "Steady-state error",
      peak_speed_rpm: "Peak speed (approx.)",
    } as Record<string, string>,
    frequency: {
      bandwidth_3db_hz: `Bandwidth, −3${S}dB`,
      bandwidth_90deg_hz: "Bandwidth, −90°",
      phase_margin_deg: "Phase margin",
      gain_margin_db: "Gain margin",
      delay_s: "Delay of the loop",
    },
    interval: `95${S}%`,
    errorMean: "mean over 200\u202fms",
    plusMinus: (ms: string) => `±${ms}`,
    never: "never",
    unsettled: "does not settle",
    notReliable: "not reliable",
    notMeasured: "not measured",
    spread: (low: string, high: string, n: number) => `${low} to ${high}, ${n} steps`,
    reached: (n: number, of: number) => `${n} of ${of} steps`,
    within: "within error",
    points: (n: string) => `${n} points`,
    hunting: "Hunting",
    verdict: { none: "none", slight: "slight", hunting: "hunting" },
    swing: (what: string, deg: string) => `${what}, ±${deg}`,
    began: "new",
    gone: "gone",
    more: "More metrics",
    parameters: "Parameter differences",
    same: "All parameters are the same.",
    conditions: "Conditions",
    setUp: "Set-up",
    supply: "Supply",
    board: "Board",
    firmware: "Firmware",
    rate: "Samples/s",
    note: "Note",
    none: "none",
    unknown: "–",
  },

  column: {
    label: "Actions",
    improve: "Improve",
    gains: "Gains",
    mechanics: "Mechanics",
  },

  improve: {
    goal: "Goal",
    goals: { calm: "Calm", fast: "Fast", stiff: "Stiff" },
    means: {
      calm: "Calm: no hunting and little overshoot, with wide margins. The step may take longer.",
      fast: "Fast: the shortest settling time without hunting.",
      stiff: "Stiff: the highest holding gain that does not hunt. The step may take longer.",
    },
    range: "Angle range",
    rangeFrom: "Angle range: farthest counterclockwise, °",
    rangeTo: "to",
    rangeUpTo: "Angle range: farthest clockwise, °",
    torque: "Torque, at most",
    speed: "Speed, at most",
    time: "Time, at most",
    rangeWrong: "Enter angles of −45 to 0° and 0 to +45°, at least 2° apart.",
    torqueWrong: "Enter a torque of 5 to 100 %.",
    speedWrong: "Enter a speed of 5 to 300 rpm.",
    timeWrong: "Enter 10 to 600 s.",
    noRoom: "The angle limits leave no room here. Move the horn away from its limit first.",
    whatMoves: "What will move",
    moves: (from: string, to: string) => `The horn moves between ${from} and ${to}`,
    most: (rpm: string, pct: string) => `, at most ${rpm} and ${pct} torque.`,
    promise: (gains: string) =>
      `It keeps only gains that measured better. Every other ending restores ${gains === "" ? "the present gains" : gains} and reads them back.`,
    open: "Improve…",
    dialogTitle: (name: string, goal: string) => `Improve ${name}: ${goal}`,
    takes: (s: string) =>
      `It measures the servo, searches on a model of it, and confirms with steps of growing size, in ${s} at most.`,
    plan: (steps: number, deg: string, rows: string) =>
      `Up to ${steps} steps of up to ${deg}. It changes: ${rows}.`,
    alike: (n: number) =>
      n === 0 ? "Tune other servos alike" : `Tune ${n} ${n === 1 ? "other servo" : "other servos"} alike`,
    alikeLead:
      "They are tuned in turn, each by up to 15° about its angle. The report shows the spread and names an outlier.",
    spread: (row: string, least: string, most: string) => `${row}: ${least} to ${most}`,
    outlier: (name: string, because: string) => `${name} differs from the others: ${because}.`,
    because: { inertia: "inertia", friction: "friction", settling_s: "settling time" } as Record<
      string,
      string
    >,
    expert: "Also tune the speed loop (not advised by the manufacturer)",
    stops:
      "Stop turns torque off at once. Torque goes on and stays on until you turn motion off or leave this page. Keep clear of the horn.",
    go: "Improve",
    enableAndGo: "Enable motion and improve",
  },

  job: {
    starting: "Starting",
    kinds: {
      step_test: "Step test",
      frequency_response: "Frequency response",
      mechanics: "Mechanics",
      improve: "Improve",
    },
    steps: (name: string) => `Steps on ${name}`,
    cancel: "Cancel",
    close: "Close",
    ends: "Cancel restores all values and returns the horn. Stop turns torque off at once.",
    holdsRam: (name: string, gains: string) =>
      `${name} now has ${gains}. Some of its values are in RAM only.`,
    holdsRom: (name: string, gains: string) => `${name} now has ${gains}, as in ROM.`,
  },

  setUp: {
    title: "Set-up",
    change: "Change",
    notStated: "Not stated. State load and mounting, so that runs can be compared.",
    sameFor: (letters: readonly string[]) => `The same for ${and(letters)}.`,
    otherFor: (letters: readonly string[]) => `Not that of ${and(letters)}.`,
    dialogTitle: "Set-up",
    dialogLead: "Stored for this servo and copied into each run. Leave a field empty if it is not known.",
    save: "Save set-up",
    fields: {
      arm_mm: "Arm",
      mass_g: "Mass at its end",
      inertia_gm2: "or inertia",
      load_nm: "Constant load, + clockwise",
      supply_v: "Supply",
      ambient_c: "Ambient temperature",
    },
    mounting: "Mounting",
    unknown: "Not stated",
    mountings: {
      bench: "loose on the bench",
      vice: "in a vice",
      vehicle: "in its vehicle",
      other: "other mounting",
    },
    oneInertia: "Enter either arm and mass, or the inertia.",
    between: (field: string, range: string) => `${field}: enter ${range}.`,
    range: (low: string, high: string) => `${low} to ${high}`,
    armWithMass: (arm: string, mass: string) => `arm ${arm} with ${mass} at its end`,
    armOf: (arm: string) => `arm ${arm}`,
    massOf: (mass: string) => `mass ${mass}`,
    inertiaOf: (inertia: string) => `inertia ${inertia}`,
    loadOf: (load: string) => `load ${load}`,
  },

  mechanics: {
    nothing: "Not measured yet.",
  },

  gains: {
    title: "Gains to try",
    lead: "Written to RAM only. A restart restores the values in ROM.",
    apply: (n: number) => (n === 1 ? "Apply 1 change" : `Apply ${n} changes`),
    applySub: "RAM only",
    discard: "Discard",
    keep: "Go to save",
    unsaved: (n: number) => `${n} ${n === 1 ? "value is" : "values are"} in RAM only.`,
    busy: "Wait for the test to end.",
    none: "The gains of this servo have not been read yet.",
    table: "Gains to try",
  },
};
