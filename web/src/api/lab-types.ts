/** Aliases of the generated JSON types of step tests and the recorder. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type StepTestOptions = Shapes["StepTest"];
export type StepMetrics = Shapes["StepMetrics"];
export type StepTrace = Shapes["StepTrace"];
export type StepRun = Shapes["StepRun"];
export type RunOverlay = Shapes["RunOverlay"];
export type RecorderState = Shapes["RecorderState"];
export type Recording = Shapes["Recording"];
export type RecordingMark = Recording["marks"][number];
export type RecordingContent = Shapes["RecordingContent"];
export type RecordingColumns = RecordingContent["telemetry"][number];
export type SetUp = Shapes["SetUp"];
export type RunVerdict = Shapes["Verdict"];
export type Estimate = Shapes["Estimate"];
export type FrequencyResponse = Shapes["FrequencyResponse"];
export type FrequencyCurve = Shapes["FrequencyCurve"];
export type FrequencyMetrics = Shapes["FrequencyMetrics"];
export type FrequencyTestOptions = Shapes["FrequencyTest"];
export type Tuning = Shapes["Tuning"];
export type ImproveOptions = Shapes["Improve"];
export type ImprovePreview = Shapes["ImprovePreview"];
export type Mechanics = Shapes["Mechanics"];
export type MechanicsValue = Shapes["MechanicsValue"];
export type MechanicsOptions = Shapes["MeasureMechanics"];
export type MechanicsTest = Shapes["MechanicsTest"];
export type Plant = Shapes["PlantConstants"];
